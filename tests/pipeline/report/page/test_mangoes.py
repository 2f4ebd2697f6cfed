"""The mangoes of Table I are those of the paper, and told apart where their error bars do not meet."""

import dataclasses

import numpy as np
import pytest

from pipeline.report.page.mangoes import ModulusBar, alike_pairs, seen_mangoes
from sensor.design.mango_tests import MANGOES

TABLE = [
    (3.23, 0.03), (1.78, 0.18), (1.1, 0.09), (1.0, 0.15), (2.42, 0.08),
    (3.18, 0.15), (1.75, 0.14), (1.41, 0.15), (3.08, 0.08), (1.08, 0.27),
]  # fmt: skip
"""Table I, ISBN 978-988-14048-7-9: modulus and scatter [MPa] of mango 1 to 10."""


def test_table_is_that_of_the_paper():
    assert [(one.E_MPa, one.scatter_MPa) for one in MANGOES] == TABLE
    assert [one.number for one in MANGOES] == list(range(1, 11))
    assert [one.variety for one in MANGOES] == ["Totapuri"] * 5 + ["Tommy Atkins"] * 5


def test_bars_that_meet_are_alike():
    bars = [ModulusBar(1.0, 2.0), ModulusBar(1.9, 2.5), ModulusBar(2.6, np.inf), None]
    assert alike_pairs(bars) == [(0, 1), (0, 3), (1, 3), (2, 3)]


def with_bars(report, share):
    """Return the report of a sensor whose calibrated error bar is a share of the modulus [1]."""
    E = np.array(report.curve.E_MPa)
    ends = {"E_lower_calibrated_MPa": tuple(E * (1.0 - share)), "E_upper_calibrated_MPa": tuple(E * (1.0 + share))}
    return dataclasses.replace(report, curve=dataclasses.replace(report.curve, **ends))


@pytest.mark.parametrize("share", [0.001, 0.05, 0.3])
def test_pairs_told_apart_are_those_whose_moduli_differ_by_more_than_both_errors(share, flat_page):
    seen = seen_mangoes(with_bars(flat_page.report, share))
    alike = alike_pairs([one.calibrated for one in seen])
    moduli = [E for E, _ in TABLE]
    apart = sum(a * (1.0 + share) < b * (1.0 - share) for a in moduli for b in moduli)
    assert 45 - len(alike) == apart


def test_mangoes_show_the_ratio_of_the_law(flat_page):
    """P between moduli of the curve: as near as its steps, (E_max / 72)^2 of a smooth line."""
    springs = flat_page.result.springs.stiffnesses
    K_m = np.array([one.mango.E_MPa for one in seen_mangoes(flat_page.report)]) * flat_page.result.contact.K_m_over_E()
    law = springs.K_h * (K_m + springs.K_l) / (springs.K_l * (K_m + springs.K_h))
    assert [one.P for one in seen_mangoes(flat_page.report)] == pytest.approx(law.tolist(), rel=1e-4)

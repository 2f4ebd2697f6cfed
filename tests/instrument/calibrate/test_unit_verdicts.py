"""Verdicts of a unit are those of the law at its springs, undecided where these are uncertain."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.optimize import brentq

from instrument.calibrate.unit_table import UnitRow
from instrument.calibrate.unit_verdicts import unit_verdicts
from sensor.theory.two_spring_law import Springs, force_ratio, nonlinearity


def laws(paper):
    """Return P_max and NL of the pair as functions of factors of its springs."""
    K_m = 3.5 * paper.contact.K_m_over_E()

    def at(law, low, high):
        K_l, K_h = paper.K * (low, high)
        return law(Springs(K_l=K_l, K_h=K_h), K_m)

    return {"P_max": partial(at, force_ratio), "NL": partial(at, nonlinearity)}


@pytest.mark.parametrize(("index", "name"), [(0, "P_max"), (1, "NL")])
def test_value_passes_within_its_tolerance(index, name, paper):
    """The high spring is stiffer by what the law says takes the value just inside or outside: 1 % of P, 0.001 of NL."""
    law = laws(paper)[name]
    target = getattr(paper.design.nominal_targets, name)
    allowed = 0.01 * target if name == "P_max" else 0.001
    for fraction, passed in ((0.99, True), (1.01, False)):
        stiffer = brentq(lambda high, off=fraction: abs(law(1.0, high) - target) - off * allowed, 1.0, 1.3)
        verdict = unit_verdicts(paper.measuring((1.0, stiffer)), ())[index]
        assert (verdict.name, verdict.passed) == (name, passed)
        assert verdict.value == pytest.approx(law(1.0, stiffer), rel=1e-6)
        assert verdict.limit == target


def test_unit_on_one_side_of_the_fruit_is_judged_by_the_stiffness_under_each_tip(paper):
    """The compliance under the high tip, less crosstalk, is 4 % larger: the fruit is that much softer there."""
    sensor = paper.measuring()
    contact = sensor.report.compliance
    S = contact.S.copy()
    S[1, 1] += 0.04 * (S[1, 1] - S[0, 1])
    unlike = replace(sensor, report=replace(sensor.report, compliance=replace(contact, S=S)))
    E = paper.design.fruit.E_max_MPa
    K_l, K_h = paper.K
    forces = np.linalg.solve(np.diag([1.0 / K_l, 1.0 / K_h]) + S / E, [0.6, 0.6])
    assert unit_verdicts(unlike, ())[0].value == pytest.approx(forces[1] / forces[0], rel=1e-9)


@pytest.mark.parametrize(("index", "name"), [(0, "P_max"), (1, "NL")])
def test_verdict_is_undecided_where_its_springs_are_uncertain(index, name, paper):
    """Its error is that of the law at other springs; at 1 % above what is allowed it decides nothing any more."""
    law = laws(paper)[name]
    changes = [law(1.001, 1.0) - law(1.0, 1.0), law(1.0, 1.001) - law(1.0, 1.0)]
    of_percent = 2.0 * np.linalg.norm(changes) / 1e-3 * 0.01  # half width that holds 95 %
    widest = (0.01 * paper.design.nominal_targets.P_max, 0.001)[index] / of_percent
    for percent, passed in ((0.98 * widest, True), (1.02 * widest, None)):
        verdict = unit_verdicts(paper.measuring(percent=percent), ())[index]
        assert verdict.error == pytest.approx(of_percent * percent, rel=0.01)
        assert verdict.passed is passed
        assert (verdict.remedy is None) == bool(passed)


@pytest.mark.parametrize("asked", [True, False])
def test_verdict_of_a_square_is_what_its_springs_leave_of_a_reading(asked, mango):
    """One standard deviation of the worst row against the limit of the design, or a tenth where it asks for none."""
    sensor = mango.measuring(percent=1.0)
    if not asked:
        sensor = replace(sensor, report=replace(sensor.report, design=replace(mango.design, reading=None)))
    asks = mango.design.reading
    limit = asks.uncertainty_limit_at(1.0, mango.design.fruit.E_MPa) if asked else 0.1
    for u, passed in ((2.0 * limit, True), (2.01 * limit, False)):
        rows = [UnitRow(E=1.0, forces=(), P=1.0, u=half, with_design=0.0) for half in (0.01, u, 0.02)]
        (verdict,) = unit_verdicts(sensor, rows)
        assert (verdict.value, verdict.limit, verdict.passed) == (pytest.approx(0.5 * u), limit, passed)

"""Sideways stiffness as a verdict: what passes, what a thin plate does, and what an error bar leaves open."""

import pytest

from cad.layout import housing_for
from cad.materials import PROCESSES
from cad.parameters import Design
from cad.printable import check_printable
from cad.springs import Springs
from pipeline.behaviour import _frequency
from pipeline.fabrication import sideways_verdict
from pipeline.springs import PrintedSpring

PETG = PROCESSES["fdm-petg"]
PRINTABLE = check_printable(Design(), Springs(K_l=0.906, K_h=20.83), 4.63, PETG)


def spring(name):
    return PrintedSpring(name=name, target=1.0, printable=PRINTABLE[0], stiffness=1.0)


@pytest.mark.parametrize(
    ("name", "K", "step", "passed"),
    [
        ("low", 3.2, 0.01, True),
        ("low", 2.9, 0.01, False),
        ("high", 1.78, 0.01, True),
        ("high", 0.70, 0.01, False),  # the shared study's 6 mm deep plate
        ("high", 1.205, 0.01, None),
    ],
)
def test_sideways_stiffness_against_its_least_share(name, K, step, passed):
    assert sideways_verdict(spring(name), K, step).passed is passed


def test_frequency_is_that_of_the_shuttle_and_its_leaves():
    """PETG block 6 x 10 x 19 mm with its neck and tip weighs 1.6 g; 0.906 N/mm on it and 0.38 of two leaves."""
    housing = housing_for(Design(), PETG, (28.9, 14.8), (0.5, 0.11))
    found = _frequency(housing, housing.low, 0.906, PETG, "low")
    assert found == pytest.approx((0.906e6 / 1.75) ** 0.5 / 6.283, rel=0.06)

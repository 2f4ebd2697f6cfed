"""Sideways stiffness as a verdict: what passes, what a thin plate does, what an error bar leaves open; bridges."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from cad.design.parameters import Design
from cad.design.printability import check_printable
from cad.design.processes import PROCESSES
from cad.parts.layout import housing_for
from cad.theory.two_spring_law import Springs
from pipeline.fit.foils import bonded_foils
from pipeline.fit.leaf_lengths import FittedFlexures
from pipeline.stages.characteristics import _frequency, behaviour_entry
from pipeline.stages.fabrication import sideways_verdict
from pipeline.stages.springs import PrintedSpring, PrintedSprings
from solve.housing.stiffness import HousingStiffness

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


def printed(gauges, strain):
    """Springs of 1 N/mm that were never solved, their gauges under a given strain per newton."""
    housing = dataclasses.replace(housing_for(Design(), PETG, (30.0, 16.0), (0.5, 0.11)), gauges=gauges)
    stiffness = HousingStiffness(
        C=np.eye(2), K=(1.0, 1.0), error_percent=(0.1, 0.1), strain_per_N=(1e-3, 1e-3), strain_error_percent=(1.0, 1.0),
        tilt_per_N=(0.0, 0.0), dofs=1, seconds=0.0, status="", gauge_strain_per_N=strain,
        gauge_error_percent=None if strain is None else (3.0, 2.0),
    )  # fmt: skip
    low, high = (
        PrintedSpring(name=name, target=1.0, printable=PRINTABLE[0], stiffness=1.0, flexure=flexure)
        for name, flexure in (("low", housing.low), ("high", housing.high))
    )
    fitted = FittedFlexures(housing=housing, stiffness=stiffness, solves=(1, 1), seconds={})
    return PrintedSprings(low=low, high=high, process=PETG, deflections=(0.5, 0.11), fitted=fitted)


def forces(low, high):
    return SimpleNamespace(responses=[SimpleNamespace(F_l=np.array([0.0, low]), F_h=np.array([0.0, high]))])


def test_bridge_with_gauges_shows_the_strain_of_the_solve_with_them():
    """A full bridge gives gauge factor 2.1 x strain: 1e-3 a newton at 0.4 N is 0.84 mV/V."""
    entry = behaviour_entry(printed("foil", (1e-3, 2e-4)), forces(0.4, 2.0))
    assert entry["gauges"] == "foil"
    assert entry["low"]["bridge_mV_per_V"] == pytest.approx([2.1 * 0.4])
    assert entry["high"]["bridge_mV_per_V"] == pytest.approx([2.1 * 0.4])
    assert (entry["low"]["bridge_error_percent"], entry["high"]["bridge_error_percent"]) == (3.0, 2.0)


def test_bridge_without_gauges_is_the_beam_s():
    """Root strain 3 t d / L^2 at 0.4 mm, less a tenth for a grid of 3 mm on 30."""
    entry = behaviour_entry(printed("none", None), forces(0.4, 2.0))
    assert entry["low"]["bridge_mV_per_V"] == pytest.approx([2.1e3 * 3.0 * 0.8 * 0.4 / 900.0 * 0.9])
    assert entry["low"]["bridge_error_percent"] is None


def test_gauges_lie_on_the_upper_leaf_at_both_roots_and_on_both_faces():
    housing = printed("foil", None).fitted.housing
    wall, shuttle = housing.low_root
    level = housing.lower_leaf_level + 14.0
    metal = [one for one in bonded_foils(housing) if one.grid and one.tip == 0]
    found = sorted((one.sign, one.z - level, sorted(one.grid[0])) for one in metal)
    at_wall, at_shuttle = [wall + 1.0, wall + 4.0], [shuttle - 4.0, shuttle - 1.0]
    above, below = ((1.0, 0.4, at_wall), (-1.0, 0.4, at_shuttle)), ((-1.0, -0.4, at_wall), (1.0, -0.4, at_shuttle))
    for (sign, z, grid), wanted in zip(found, sorted((*above, *below)), strict=True):
        assert (sign, z) == pytest.approx(wanted[:2])
        assert grid == pytest.approx(wanted[2])


def test_stiffening_is_the_elastica_s_for_the_leaf_and_the_deflection_of_each_spring():
    """36/35 (d / L)^2 while d is small: 0.5 mm on 30 and 0.11 mm on 16."""
    entry = behaviour_entry(printed("none", None), forces(0.4, 2.0))
    for name, d, L in (("low", 0.5, 30.0), ("high", 0.11, 16.0)):
        assert entry[name]["large_deflection_stiffening"] == pytest.approx(36.0 / 35.0 * (d / L) ** 2, rel=1e-3)

"""The wires of a bridge, read from fabrication.md, give the output that the sheet promises on a guided leaf."""

import re
from dataclasses import replace

import numpy as np
import pytest

from cad.drawing.sheet import Title
from cad.fabrication.bridges import RESISTANCE_OHM, Spring, SpringReadOut
from cad.fabrication.fabrication_sheet import fabrication_sheet
from sensor.design.processes import PROCESSES
from sensor.theory.strain_gauge import FOIL

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
GAUGES = ("W down", "W up", "S down", "S up")
OPPOSITE = [("W down", "W up"), ("S down", "S up"), ("W down", "S down"), ("W up", "S up")]


@pytest.fixture(scope="module")
def spring(sensor):
    arm = sensor.housing.arms[0]
    return Spring(name=arm.name, flexure=arm.flexure, K=0.9, deflection=0.1)


@pytest.fixture(scope="module")
def sheet(spring, sensor):
    gauged = replace(sensor, housing=replace(sensor.housing, gauges="foil"))
    return fabrication_sheet(gauged, TITLE, (), SpringReadOut(springs=(spring,)))


def wires(sheet):
    """Return by gauge the two terminals that its ends are wired to."""
    rows = re.findall(r"^\| (?:red|black|white|green) \| (E\+|E-|A\+|A-) \| (.*) \|$", sheet, re.MULTILINE)
    assert sorted(terminal for terminal, _ in rows) == ["A+", "A-", "E+", "E-"]
    return {gauge: tuple(terminal for terminal, text in rows if gauge in text) for gauge in GAUGES}


def strains(spring):
    """Return by gauge its mean strain [1] as 1 N moves the shuttle up: w = d (3 s^2 - 2 s^3), strain -y w''.

    W lies at s = 0, S at s = 1; the mean of w'' under a grid is the difference of the slopes at its ends over it.
    """
    flexure, grid = spring.flexure, FOIL.grid_length_mm

    def slope(x):
        s = x / flexure.length
        return 6.0 * s * (1.0 - s) / (spring.K * flexure.length)

    ends = {"W": (0.0, grid), "S": (flexure.length - grid, flexure.length)}
    bend = {root: (slope(b) - slope(a)) / grid for root, (a, b) in ends.items()}
    outward = {"up": 0.5 * flexure.thickness, "down": -0.5 * flexure.thickness}
    return {name: -outward[name.split()[1]] * bend[name.split()[0]] for name in GAUGES}


def output(wired, spring):
    """Return A+ over A- at 1 N [mV/V] by Kirchhoff's current law in the four resistors."""
    conductance = np.zeros((4, 4))
    order = ["A+", "A-", "E+", "E-"]
    for gauge, strain in strains(spring).items():
        i, j = (order.index(terminal) for terminal in wired[gauge])
        one = 1.0 / (RESISTANCE_OHM * (1.0 + FOIL.gauge_factor * strain))
        conductance[[i, j], [i, j]] += one
        conductance[[i, j], [j, i]] -= one
    supply = np.array([1.0, 0.0])
    plus, minus = np.linalg.solve(conductance[:2, :2], -conductance[:2, 2:] @ supply)
    return 1e3 * (plus - minus)


def test_wires_of_the_sheet_give_the_output_it_promises(sheet, spring):
    wired = wires(sheet)
    assert all(len(ends) == 2 for ends in wired.values())
    assert output(wired, spring) == pytest.approx(spring.bridge_output, rel=1e-9)
    assert f"| {spring.name} | 0.09 | 0.1 | {output(wired, spring):.3g} |" in sheet
    bent = strains(spring)
    for one, other in OPPOSITE:
        assert bent[one] == pytest.approx(-bent[other], rel=1e-12)
        assert len(set(wired[one]) & set(wired[other])) == 1  # neighbouring arms, as the sheet says

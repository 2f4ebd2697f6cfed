from contextlib import nullcontext

import numpy as np
import pytest

from sensor.design.fruit import Fruit
from solve.contact.pressure_cells import contact_cells, half_cells
from solve.contact.unilateral import COMPLEMENTARITY, UnilateralContact, _check_complementarity
from solve.fruit.curved_shape import cap_gap
from solve.fruit.footprints import Footprint
from solve.halfspace.punch import graded_edges
from solve.linear import SolveError

BLOCK = Fruit(length_mm=20.0, width_mm=20.0, height_mm=12.0, poisson=0.3)
FEET = (Footprint(-4.0, 0.0, 1.0), Footprint(4.0, 0.0, 1.0))
K = np.array([0.753, 17.3])  # N/mm, the paper's springs


@pytest.fixture(scope="module")
def footprints():
    return contact_cells(BLOCK, FEET, graded_edges(12))


def housing_travel(cells, x, tilt=0.0, roll=0.0):
    """Return the travel of a rigid housing over every cell [mm], x that of its middle."""
    return x + cells.points @ np.tan(np.radians([tilt, roll]))


def pressed(footprints, x, E=1.0, tilt=0.0, roll=0.0, gap=0.0):
    return UnilateralContact(footprints).solve(housing_travel(footprints, x, tilt, roll) - gap, np.diag(E / K))


def area(cells, touch):
    """Return the area of the touching cells under each tip [mm^2]."""
    return cells.tips.T @ ((touch.pressure > 0.0) * cells.areas)


def assert_complementary(touch, length):
    """Check p >= 0, gap >= 0 and p gap = 0 to 1e-8 of the largest."""
    finite = np.isfinite(touch.gap)
    assert touch.pressure.min() >= 0.0
    assert touch.gap.min() >= -COMPLEMENTARITY * length
    assert np.all(touch.pressure[~finite] == 0.0)
    assert np.abs(touch.pressure[finite] * touch.gap[finite]).max() <= COMPLEMENTARITY * length * touch.pressure.max()


@pytest.mark.parametrize(("tilt", "roll"), [(0.5, 0.0), (5.0, 0.0), (-5.0, 0.0), (10.0, 0.0), (0.0, 3.0), (2.0, -2.0)])
@pytest.mark.parametrize("x", [0.02, 0.3])
def test_tilted_contact_is_complementary(footprints, tilt, roll, x):
    touch = pressed(footprints, x, 2.0, tilt, roll)
    assert_complementary(touch, x + 4.5 * np.tan(np.radians(abs(tilt))))
    assert np.all(area(footprints, touch) <= 1.0 + 1e-12)


def test_slope_is_the_rate_of_the_force(footprints):
    contact = UnilateralContact(footprints)
    step = 1e-6
    middle = contact.solve(housing_travel(footprints, 0.3, 3.0), np.diag(1.0 / K))
    low, high = (contact.solve(housing_travel(footprints, 0.3 + d, 3.0), np.diag(1.0 / K)).F for d in (-step, step))
    np.testing.assert_allclose(middle.slope, (high - low) / (2.0 * step), rtol=1e-6)


def test_folded_cells_answer_as_all_of_them(footprints):
    """Contact alike at y and -y needs half of the cells."""
    half = half_cells(footprints)
    assert len(half.owner) == len(footprints.owner) // 2
    for tilt, x in ((0.0, 0.3), (3.0, 0.3), (-8.0, 0.5)):
        one, other = (
            UnilateralContact(cells).solve(housing_travel(cells, x, tilt), np.diag(1.0 / K))
            for cells in (footprints, half)
        )
        np.testing.assert_allclose(other.F, one.F, rtol=1e-10)
        np.testing.assert_allclose(area(half, other), area(footprints, one), rtol=1e-12)


def on_a_cap(footprints):
    """Press on a fruit of radius 35 mm: an edge of each tip touches, which the active set must find in steps."""
    return pressed(footprints, 0.35, 2.0, gap=cap_gap(*footprints.points.T, 35.0, 35.0))


def test_cycling_active_set_falls_back_on_least_squares(footprints, monkeypatch):
    right = on_a_cap(footprints)
    monkeypatch.setattr("solve.contact.unilateral.MOST_STEPS", 1)
    np.testing.assert_allclose(on_a_cap(footprints).F, right.F, rtol=1e-8)


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("violation", ["tension", "penetration", "force at a gap"])
def test_violations_are_relative_to_the_largest_force_and_length(violation, length):
    """The largest force is length^2, and the largest interference is length."""
    for size in (0.9 * COMPLEMENTARITY, 1.1 * COMPLEMENTARITY):
        f, gap = np.array([0.0, length**2]), np.zeros(2)
        if violation == "tension":
            f[0] = -size * length**2
        elif violation == "penetration":
            gap[0] = -size * length
        else:
            gap[1] = size * length
        with nullcontext() if size < COMPLEMENTARITY else pytest.raises(SolveError):
            _check_complementarity(f, gap, np.full(2, length))


def test_a_state_that_is_not_complementary_is_refused(footprints, monkeypatch):
    monkeypatch.setattr(UnilateralContact, "_solve_by_least_squares", lambda *arguments: 0.0 * arguments[2])
    monkeypatch.setattr("solve.contact.unilateral.MOST_STEPS", 1)
    with pytest.raises(SolveError, match="complementarity"):
        on_a_cap(footprints)

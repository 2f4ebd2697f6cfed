"""Constants of the compliance of a block: rules of its mesh and error bars of the split."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from covering import covers

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit import box
from solve.fruit.split import LEAST_STEP, LEVELS, ORDER, SAFETY, split_compliance

pytestmark = pytest.mark.study

MUCH = 1e3  # sides: extents of a block that is as good as a half-space
PAPER = Fruit()
LOW = Fruit(height_mm=2.0, poisson=0.45)


def on_mesh(fruit, grading, spacing=8.0):
    """Return the compliance under tips of 1 mm on the mesh of this grading alone, whatever its error."""
    with patch.multiple("solve.fruit.split", LEVELS=(grading,), LARGEST_ERROR=1.0):
        return split_compliance(fruit, Tips(spacing_mm=spacing))


def pair(S):
    """Return the mean of s11 and s22 less s12, times E [1/mm]."""
    return float(0.5 * (S[0][0] + S[1][1]) - S[0][1])


def of_remainder(fruit, spacing=8.0):
    """Return what the finite block changes of s11 - s12 and of s11 [1], shape (2,)."""
    here = on_mesh(fruit, LEVELS[0], spacing).S
    half_space = on_mesh(replace(fruit, length_mm=MUCH, width_mm=MUCH, height_mm=MUCH), LEVELS[0], spacing).S
    return np.array([abs(pair(half_space) / pair(here) - 1.0), abs(half_space[0][0] / here[0][0] - 1.0)])


@pytest.mark.parametrize(
    ("rule", "strict", "fruit"),
    [
        ("SLENDER", 0.25, Fruit(length_mm=12.0, width_mm=12.0, height_mm=40.0)),
        ("SCREENED", 4.0, Fruit(length_mm=24.0, width_mm=16.0, height_mm=3.0)),
        ("DEPTH", 0.25, Fruit(height_mm=3.0)),
    ],
)
def test_rule_of_the_mesh_four_times_as_strict_stays_within_the_bar(rule, strict, fruit, monkeypatch):
    before = on_mesh(fruit, LEVELS[0])
    monkeypatch.setattr(box, rule, strict * getattr(box, rule))
    after = on_mesh(fruit, LEVELS[0])
    assert abs(pair(after.S) / pair(before.S) - 1.0) <= before.difference_error


def test_bar_of_the_split_covers_its_error_over_the_step_between_two_meshes():
    left = 1.0 / (box.COARSER**-ORDER - 1.0)
    assert pytest.approx(2.0 * left, abs=0.05) == SAFETY
    shares, least = [], []
    for fruit in (PAPER, LOW):
        coarse, fine, truth = (pair(on_mesh(fruit, each).S) for each in (LEVELS[0].coarser(), LEVELS[0], LEVELS[2]))
        shares.append(abs(fine - truth) / abs(fine - coarse))
        remainder = of_remainder(fruit)
        least.append(abs(fine / truth - 1.0) / (0.5 * (remainder[0] + remainder.max())) / SAFETY)
    assert covers(SAFETY, shares)
    assert min(least) <= LEAST_STEP <= max(least)

"""ROUGH_LIFT and ROUGH_ERROR of leaf lengths: the rough mesh against the mesh to solve on, on random designs."""

from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest
from random_designs import ROUGH, random_designs

from cad.parts.pin import pin_compliance
from pipeline.response.contact import fruit_compliance
from pipeline.springs.fitted_springs import FittedSprings, springs_for
from pipeline.springs.leaf_lengths import DEFAULT, HousingSolver, add_pin_compliance
from pipeline.springs.sizing import spring_sizing


def rough_springs(seed: int) -> Iterator[FittedSprings]:
    """Yield the rough springs of random designs; those whose leaves the solve does not let print are left out."""
    for design in random_designs(seed):
        sizing = spring_sizing(design, fruit_compliance(design, ROUGH), ROUGH)
        springs = springs_for(design, sizing, "fitted", ROUGH.tolerance)
        if springs.fitted is not None:
            yield springs


def compared(springs: FittedSprings) -> tuple[np.ndarray, np.ndarray]:
    """Return error over bar of the stiffnesses and of the root strains of a rough fit [1], each of shape (2,)."""
    housing = springs.fitted.housing
    rough = springs.fitted.stiffness
    E, poisson = springs.process.E_MPa, springs.process.poisson
    solver = HousingSolver(E, poisson)
    feet = DEFAULT.stiffness_with_errors(
        housing, solver.solve(housing, DEFAULT.fine), solver.solve(housing, DEFAULT.coarse)
    )
    fine = feet if housing.pin is None else add_pin_compliance(feet, pin_compliance(housing.pin, E, poisson))
    of_K = np.abs(np.array(rough.K) / fine.K - 1.0) / rough.error
    of_strain = np.abs(np.array(rough.strain_per_N) / fine.strain_per_N - 1.0) / rough.strain_error
    return of_K, of_strain


@pytest.mark.slow
def test_rough_springs_lie_within_their_bars():
    of_K, of_strain = compared(next(rough_springs(11)))
    assert max(of_K.max(), of_strain.max()) < 1.0


@pytest.mark.study
def test_bars_of_rough_springs_cover_random_designs_and_are_not_far_too_wide():
    found = [compared(springs) for springs in islice(rough_springs(12), 300)]
    of_K = np.array([of_K for of_K, _ in found])
    assert 1.0 / 3.0 < of_K.max() < 1.0
    assert max(of_strain.max() for _, of_strain in found) < 1.0

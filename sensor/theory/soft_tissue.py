"""Corrections for soft tissue under a tip: grip and large strain, which linear frictionless contact neglects.

The grip has a closed form. The forces at large strain were computed by finite elements and are stored in
large_strain.toml.
"""

import functools
import math
import tomllib
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from sensor.arrays import Floats

FleshLawName = Literal["neo-hooke", "hencky", "foam"]
FLESH_LAWS: tuple[FleshLawName, ...] = ("neo-hooke", "hencky", "foam")

LEAST_COMPRESSIBLE = 0.4995  # Poisson's ratio above which a gripping tip is practically as stiff as a frictionless tip
LARGEST_POISSON = 0.49  # largest Poisson's ratio for which the finite elements at large strain were tested
LARGEST_CHANGE = 0.9  # largest relative change of a stiffness; the formulas do not hold beyond it
_DATA = Path(__file__).parent / "large_strain.toml"


def no_slip_stiffness_change(poisson: float) -> float:
    """Return the relative increase [1] in the stiffness of a circular tip on a half-space if it does not slip.

    The increase is (1 - nu) ln(3 - 4 nu) / (1 - 2 nu) - 1: D. A. Spence, Proc. R. Soc. A 305, 1968, doi
    10.1098/rspa.1968.0105.
    """
    nu = min(poisson, LEAST_COMPRESSIBLE)
    return (1.0 - nu) * math.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu) - 1.0


def large_strain_factor(depth: Floats | float, poisson: float, law: FleshLawName = "neo-hooke") -> Floats:
    """Return the force of a sharp-edged tip at large strain, divided by the linear force [1], at indentations `depth`.

    `depth` is in tip sides, and the result has its shape. `poisson` and `law` are Poisson's ratio and the constitutive
    law of the flesh. The factor is 1 at first contact. Between the depths and Poisson's ratios of the finite-element
    solutions, the factor is interpolated linearly. Beyond the deepest solution, its deviation from 1 is proportional to
    the depth, up to `LARGEST_CHANGE`.
    """
    table = _table(law)
    change = np.zeros(np.shape(depth))
    # There is one row of the table for each Poisson's ratio. The weight of a row is 1 at its own Poisson's ratio, 0 at
    # the others, and linear in between.
    weights_at_ratios = np.eye(len(table.rows))
    for (solved_depths, factors), row_weights in zip(table.rows, weights_at_ratios, strict=True):
        extrapolation = np.maximum(1.0, depth / solved_depths[-1])
        change_of_row = (np.interp(depth, solved_depths, factors) - 1.0) * extrapolation
        change = change + np.interp(poisson, table.poissons, row_weights) * change_of_row
    return np.asarray(1.0 + np.clip(change, -LARGEST_CHANGE, LARGEST_CHANGE))


def largest_solved_depth() -> float:
    """Return the largest depth of the finite-element solutions at large strain [tip sides].

    Below nu = 0.3 the solutions may end earlier, because the surface folds.
    """
    return _table("neo-hooke").depths[-1]


def constitutive_spread(depth: Floats | float, poisson: float) -> Floats:
    """Return half the difference of the force factors [1] of Hencky's and Storakers' laws at a depth [tip sides]."""
    difference = large_strain_factor(depth, poisson, "hencky") - large_strain_factor(depth, poisson, "foam")
    return np.asarray(0.5 * np.abs(difference))


class _FactorTable(NamedTuple):
    """Depths [tip sides], starting at first contact, and the factors of the force [1] there, for each Poisson's ratio.

    A row may end before the largest of `depths`.
    """

    depths: list[float]
    poissons: list[float]
    rows: list[tuple[Floats, Floats]]


@functools.cache
def _table(law: FleshLawName) -> _FactorTable:
    """Read the table of a constitutive law of flesh."""
    data = tomllib.loads(_DATA.read_text(encoding="utf-8"))
    depths = data["depths"]
    rows = [(np.array([0.0, *depths[: len(row)]]), np.array([1.0, *row])) for row in data["factors"][law]["rows"]]
    return _FactorTable(depths=depths, poissons=data["poissons"], rows=rows)

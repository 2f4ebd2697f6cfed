"""Effects of soft tissue under a tip that linear elasticity and a frictionless tip leave out, in closed form or by FE.

Forces at large strain are read from large_strain.toml.
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

LEAST_COMPRESSIBLE = 0.4995  # Poisson's ratio beyond which a gripping tip is practically as stiff as a frictionless one
LARGEST_POISSON = 0.49  # largest Poisson's ratio at large strain, up to which the elements were tested
LARGEST_CHANGE = 0.9  # largest relative change of a stiffness; these formulas do not hold for a larger one
_DATA = Path(__file__).parent / "large_strain.toml"


def no_slip(poisson: float) -> float:
    """Return the relative increase in stiffness [1] of a circular tip on a half-space if it grips instead of slides.

    It is (1 - nu) ln(3 - 4 nu) / (1 - 2 nu) - 1, D. A. Spence, Proc. R. Soc. A 305, 1968, doi 10.1098/rspa.1968.0105.
    """
    nu = min(poisson, LEAST_COMPRESSIBLE)
    return (1.0 - nu) * math.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu) - 1.0


def large_strain_factor(depth: Floats | float, poisson: float, law: FleshLawName = "neo-hooke") -> Floats:
    """Return the force of a sharp tip at large strain relative to the linear force [1], at indentations `depth`.

    `depth` is in tip sides; the result has its shape. The factor is 1 at first touch. It is interpolated linearly
    between the depths and the Poisson's ratios of the finite-element solves. Beyond the deepest solve, its deviation
    from 1 is proportional to the depth.
    """
    table = _table(law)
    change = np.zeros(np.shape(depth))
    weights = np.eye(len(table.rows))  # of each row at each solved Poisson's ratio: 1 at its own, 0 at the others
    for (solved_depths, factors), weight in zip(table.rows, weights, strict=True):
        extrapolation = np.maximum(1.0, depth / solved_depths[-1])
        change_of_row = (np.interp(depth, solved_depths, factors) - 1.0) * extrapolation
        change = change + np.interp(poisson, table.poissons, weight) * change_of_row
    return np.asarray(1.0 + np.clip(change, -LARGEST_CHANGE, LARGEST_CHANGE))


def deepest_solved() -> float:
    """Return the largest depth of the solves at large strain [tip sides].

    Below nu = 0.3 the surface may fold earlier, which ends the solves.
    """
    return _table("neo-hooke").depths[-1]


def constitutive_spread(depth: Floats | float, poisson: float) -> Floats:
    """Return half the difference of the relative forces by Hencky's and Storakers' laws [1] at depths [tip sides]."""
    difference = large_strain_factor(depth, poisson, "hencky") - large_strain_factor(depth, poisson, "foam")
    return np.asarray(0.5 * np.abs(difference))


class _FactorTable(NamedTuple):
    """Depths [tip sides] and factors of the force [1] at these depths, from first touch on, for each Poisson's ratio.

    A row may end before the largest of `depths`.
    """

    depths: list[float]
    poissons: list[float]
    rows: list[tuple[Floats, Floats]]


@functools.cache
def _table(law: FleshLawName) -> _FactorTable:
    """Return the table of a law of flesh, cached."""
    data = tomllib.loads(_DATA.read_text(encoding="utf-8"))
    depths = data["depths"]
    rows = [(np.array([0.0, *depths[: len(row)]]), np.array([1.0, *row])) for row in data["factors"][law]["rows"]]
    return _FactorTable(depths=depths, poissons=data["poissons"], rows=rows)

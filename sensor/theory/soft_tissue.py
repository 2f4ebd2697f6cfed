"""What soft tissue under a tip does that linear elasticity and a slippery tip leave out, in closed form or by FE.

Forces at large strain are read from large_strain.toml, as reference/flat_punch solves them.
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

LEAST_COMPRESSIBLE = 0.4995  # Poisson's ratio beyond which a gripping tip is no stiffer than a slippery one
LARGEST_POISSON = 0.49  # up to which large strain is solved: the elements were measured there
LARGEST_CHANGE = 0.9  # of a stiffness; a larger one is beyond these formulas
_DATA = Path(__file__).parent / "large_strain.toml"


def no_slip(poisson: float) -> float:
    """Return how much stiffer a circular tip is on a half-space that it grips than on one it slides on [1].

    (1 - nu) ln(3 - 4 nu) / (1 - 2 nu) - 1, D. A. Spence, Proc. R. Soc. A 305, 1968, doi 10.1098/rspa.1968.0105.
    """
    nu = min(poisson, LEAST_COMPRESSIBLE)
    return (1.0 - nu) * math.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu) - 1.0


def large_strain_factor(depth: float, poisson: float, law: FleshLawName = "neo-hooke") -> float:
    """Return the force of a sharp tip over the linear one [1] at an indentation of `depth` [tip sides].

    It is 1 at first touch, and interpolated linearly between the depths and between Poisson's ratios of FE. Beyond the
    deepest solved one its departure from 1 is proportional to the depth.
    """
    table = _table(law)
    at_poisson = []
    for solved_depths, factors in table.rows:
        beyond = max(1.0, depth / solved_depths[-1])
        at_poisson.append(1.0 + (np.interp(depth, solved_depths, factors) - 1.0) * beyond)
    factor = float(np.interp(poisson, table.poissons, at_poisson))
    return min(max(factor, 1.0 - LARGEST_CHANGE), 1.0 + LARGEST_CHANGE)


def deepest_solved() -> float:
    """Return the depth down to which large strain was solved [tip sides]; a fold may end it before below nu = 0.3."""
    return _table("neo-hooke").depths[-1]


def constitutive_spread(depth: float, poisson: float) -> float:
    """Return half of what the laws of Hencky and Storakers put the force apart [1] at a depth [tip sides]."""
    apart = large_strain_factor(depth, poisson, "hencky") - large_strain_factor(depth, poisson, "foam")
    return 0.5 * abs(apart)


class _FactorTable(NamedTuple):
    """Depths [tip sides] and factors of the force [1] at them, from first touch on, for each of Poisson's ratios.

    A row may end before the deepest of `depths`.
    """

    depths: list[float]
    poissons: list[float]
    rows: list[tuple[Floats, Floats]]


@functools.cache
def _table(law: FleshLawName) -> _FactorTable:
    """Return the table of a law of flesh, read once."""
    data = tomllib.loads(_DATA.read_text(encoding="utf-8"))
    depths = data["depths"]
    rows = [(np.array([0.0, *depths[: len(row)]]), np.array([1.0, *row])) for row in data["factors"][law]["rows"]]
    return _FactorTable(depths=depths, poissons=data["poissons"], rows=rows)

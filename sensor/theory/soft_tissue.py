"""What soft tissue under a tip does that linear elasticity and a slippery tip leave out, in closed form or by FE.

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


def large_strain_factor(depth: Floats | float, poisson: float, law: FleshLawName = "neo-hooke") -> Floats:
    """Return the force of a sharp tip over the linear one [1] at indentations of `depth` [tip sides], of their shape.

    It is 1 at first touch, and interpolated linearly between the depths and between Poisson's ratios of FE. Beyond the
    deepest solved one its departure from 1 is proportional to the depth.
    """
    table = _table(law)
    change = np.zeros(np.shape(depth))
    shares = np.eye(len(table.rows))  # of the row of each solved ratio, there and at all others
    for (solved_depths, factors), share in zip(table.rows, shares, strict=True):
        beyond = np.maximum(1.0, depth / solved_depths[-1])
        at_solved_ratio = (np.interp(depth, solved_depths, factors) - 1.0) * beyond
        change = change + np.interp(poisson, table.poissons, share) * at_solved_ratio
    return np.asarray(1.0 + np.clip(change, -LARGEST_CHANGE, LARGEST_CHANGE))


def deepest_solved() -> float:
    """Return the depth down to which large strain was solved [tip sides]; a fold may end it before below nu = 0.3."""
    return _table("neo-hooke").depths[-1]


def constitutive_spread(depth: Floats | float, poisson: float) -> Floats:
    """Return half of what the laws of Hencky and Storakers put the force apart [1] at depths [tip sides]."""
    apart = large_strain_factor(depth, poisson, "hencky") - large_strain_factor(depth, poisson, "foam")
    return np.asarray(0.5 * np.abs(apart))


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

"""A polynomial that stands for the contact of a study: the half-space in closed form, the smooth rest fitted.

S of a block under flat tips of side 1 is that of the half-space, (1 - nu^2) / (pi r) from tip to tip, and a remainder
that the free sides and the base make. Far from base and sides a tip is a point, so that the remainder goes with
1 / height: times the height it is a smooth function of ratios of the fruit's lengths and of Poisson's ratio, and
depends little on side over height. A polynomial of low total degree in Chebyshev's basis is fitted to solves.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.study.levels.unit_scene import UnitScene, scene_compliance
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.split import SplitDomainError, check_domain, tip_footprints

Floats = NDArray[np.float64]
Solved = tuple[Sequence[UnitScene], Sequence[FruitCompliance]]

RATIOS = {
    "height / length": ("height_mm", "length_mm"),
    "spacing / length": ("spacing_mm", "length_mm"),
    "width / length": ("width_mm", "length_mm"),
    "side / height": ("side_mm", "height_mm"),
}
POISSON = "poisson"
SAFETY = 3.0  # times the largest of 64 errors: tests/bench/studies.py shows it against those of its audits
# Of a rigid flat tip of side 1 on a half-space, times E / (1 - nu^2) per force; the square as solve/halfspace has it.
_SQUARE_COMPLIANCE = 1.0 / 1.152302
_CIRCLE_COMPLIANCE = 1.0
_OUTSIDE = 1e-9  # of half the width of the domain: round-off


@dataclass(frozen=True, kw_only=True)
class Domain:
    """The coordinates of the scenes of a study, and the bounds of each [1]."""

    coordinates: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class ContactSurrogate(Domain):
    """S of tips of side 1 by Chebyshev polynomials of the remainder over the coordinates of a scene.

    `lower` and `upper` bound each coordinate; `degrees` has a row of one degree a coordinate for each term,
    `coefficients` a row for each entry (i, j <= i) of S. `error` [1] is that of s11 - s12 over scenes not fitted,
    with its safety; `solve_error` and `own_error` [1] are the largest of the solves.
    """

    degrees: tuple[tuple[int, ...], ...]
    coefficients: tuple[tuple[float, ...], ...]
    error: float
    solve_error: float
    own_error: float
    solves: int
    tolerance: float

    def compliance(self, scene: UnitScene) -> FruitCompliance:
        """Return the compliance of a scene in its size [1/mm]; one outside the domain is solved in full.

        Raises as `scene_compliance`.
        """
        place = self._scaled(scene_coordinates(scene, self.coordinates))
        if not self._covers(scene, place):
            return scene_compliance(scene, self.tolerance)
        degrees, coefficients = self._arrays
        basis = chebyshev_terms(place[None, :], degrees)[0]
        S = half_space(scene) + symmetric(coefficients @ basis, len(scene.tips.names)) / _height(scene)
        return FruitCompliance(
            tips=scene.tips.names,
            S=S / (scene.scale * scene.tips.side_mm),
            error_pair=self.solve_error + self.error,
            error_own=self.own_error + self.error,
            info=self._info,
        )

    @functools.cached_property
    def _arrays(self) -> tuple[NDArray[np.int64], Floats]:
        """Return the degrees (terms, coordinates) and the coefficients (entries, terms) as arrays."""
        return np.array(self.degrees), np.array(self.coefficients)

    @functools.cached_property
    def _info(self) -> SolveInfo:
        terms, error = len(self.degrees), f"{self.error:.1e}"
        status = f"polynomial of {terms} terms through {self.solves} solves, off by at most {error}"
        return SolveInfo(method="split, interpolated", dofs=0, seconds=0.0, status=status)

    def _scaled(self, places: Floats) -> Floats:
        return scaled(places, np.array(self.lower), np.array(self.upper))

    def _covers(self, scene: UnitScene, place: Floats) -> bool:
        if np.abs(place).max(initial=0.0) > 1.0 + _OUTSIDE:
            return False
        try:
            check_domain(scene.fruit, tip_footprints(scene.tips))
        except SplitDomainError:
            return False
        return True


def scene_coordinates(scene: UnitScene, names: Sequence[str]) -> Floats:
    """Return the coordinates of a scene [1], (coordinates,): ratios of lengths, and Poisson's ratio."""
    fruit, tips = scene.fruit, scene.tips
    values = {**vars(fruit), "spacing_mm": tips.spacing_mm, "side_mm": tips.side_mm}
    return np.array([coordinate(values, name) for name in names])


def coordinate(values: Mapping[str, float], name: str) -> float:
    """Return one coordinate [1] of lengths [mm] and Poisson's ratio by their keys."""
    if name == POISSON:
        return values[name]
    above, below = RATIOS[name]
    return values[above] / values[below]


def half_space(scene: UnitScene) -> Floats:
    """Return S of the tips on a half-space, far tips as points, times their side [1], shape (tips, tips)."""
    places = np.array(scene.tips.places_mm) / scene.tips.side_mm
    distance = np.linalg.norm(places[:, None] - places[None, :], axis=2)
    np.fill_diagonal(distance, 1.0)
    S = (1.0 - scene.fruit.poisson**2) / (math.pi * distance)
    own = _CIRCLE_COMPLIANCE if scene.tips.tip_shape.is_round else _SQUARE_COMPLIANCE
    np.fill_diagonal(S, (1.0 - scene.fruit.poisson**2) * own)
    return np.asarray(S)


def fit_surrogate(fitted: Solved, checked: Solved, domain: Domain, degree: int, tolerance: float) -> ContactSurrogate:
    """Return the polynomial of a total degree through fitted scenes, its error taken over checked ones.

    `tolerance` [1] is that of the springs, for scenes outside that are solved in full.
    """
    scenes, solved = fitted
    places = np.array([scene_coordinates(scene, domain.coordinates) for scene in scenes])
    degrees = total_degrees(len(domain.coordinates), degree)
    terms = chebyshev_terms(scaled(places, np.array(domain.lower), np.array(domain.upper)), degrees)
    coefficients = np.linalg.lstsq(terms, _remainders(scenes, solved), rcond=None)[0].T
    every = (*solved, *checked[1])
    model = ContactSurrogate(
        **vars(domain),
        degrees=tuple(tuple(row) for row in degrees.tolist()),
        coefficients=tuple(tuple(row) for row in coefficients.tolist()),
        error=0.0,
        solve_error=max(one.error_pair for one in every),
        own_error=max(one.error_own for one in every),
        solves=len(every),
        tolerance=tolerance,
    )
    return dataclasses.replace(model, error=SAFETY * _largest_miss(model, checked))


def _largest_miss(model: ContactSurrogate, checked: Solved) -> float:
    """Return the largest relative error of K_m / E [1] over solved scenes."""
    pairs = zip(*checked, strict=True)
    return max(abs(model.compliance(scene).K_m_over_E() / one.K_m_over_E() - 1.0) for scene, one in pairs)


def _remainders(scenes: Sequence[UnitScene], solved: Sequence[FruitCompliance]) -> Floats:
    """Return S of tips of side 1 less that of the half-space, times the height [1], shape (scenes, entries)."""
    pairs = zip(scenes, solved, strict=True)
    rest = np.array([_height(scene) * (_of_side_one(scene, one) - half_space(scene)) for scene, one in pairs])
    rows, columns = np.tril_indices(rest.shape[1])
    return np.asarray(rest[:, rows, columns])


def _height(scene: UnitScene) -> float:
    """Return the height of the fruit over the side of a tip [1]."""
    return scene.fruit.height_mm / scene.tips.side_mm


def _of_side_one(scene: UnitScene, solved: FruitCompliance) -> Floats:
    """Return S of tips of side 1 [1], shape (tips, tips)."""
    return solved.S * scene.scale * scene.tips.side_mm


def scaled(places: Floats, lower: Floats, upper: Floats) -> Floats:
    """Return coordinates [1] on -1 to 1 where they lie between their bounds."""
    return np.asarray((2.0 * places - lower - upper) / np.where(upper > lower, upper - lower, 1.0))


def total_degrees(count: int, degree: int) -> NDArray[np.int64]:
    """Return the degrees of every term whose sum is at most the total degree, shape (terms, count)."""
    rows = [row for row in itertools.product(range(degree + 1), repeat=count) if sum(row) <= degree]
    return np.array(rows, dtype=np.int64).reshape(len(rows), count)


def chebyshev_terms(places: Floats, degrees: NDArray[np.int64]) -> Floats:
    """Return the products of Chebyshev polynomials at places on -1 to 1, shape (places, terms)."""
    values = np.polynomial.chebyshev.chebvander(places, int(degrees.max()))  # (places, coordinates, degrees)
    columns = np.arange(degrees.shape[1])
    return np.asarray(values[:, columns, degrees].prod(axis=2))


def symmetric(entries: Floats, count: int) -> Floats:
    """Return the symmetric matrix of its entries (i, j <= i), shape (count, count) [their unit]."""
    return np.asarray(entries[_entry_places(count)])


@functools.cache
def _entry_places(count: int) -> NDArray[np.int64]:
    """Return which entry (i, j <= i) stands at each place of a symmetric matrix, shape (count, count)."""
    rows, columns = np.indices((count, count))
    larger, smaller = np.maximum(rows, columns), np.minimum(rows, columns)
    return np.asarray(larger * (larger + 1) // 2 + smaller)

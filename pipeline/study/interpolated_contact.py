"""Contact interpolated between solved scenes: the half-space in closed form, the smooth rest by radial functions.

S of a block under flat tips of side 1 is that of the half-space, (1 - nu^2) / (pi r) from tip to tip, and a remainder
that the free sides and the base make. Far from base and sides a tip is a point, so that the remainder goes with
1 / height: times the height it is a smooth function of the lengths and of Poisson's ratio, which SciPy interpolates.
"""

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.stats import qmc

from cad.quantity import InputError
from pipeline.study.points import Point, design_of, point_at
from pipeline.study.scenes import UnitScene, unit_scene
from pipeline.study.study_file import Study
from pipeline.study.variation import Setting, Span
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.fruit.split import SplitDomainError, check_domain, tip_footprints

Floats = NDArray[np.float64]

FEWEST_POINTS = 2_000  # of a study, from which interpolation costs less than the solves that it saves
SCENES = (128, 256, 512)  # solved for the interpolation, until its error is small enough
CHECKED = 64  # scenes solved to take its error
SAFETY = 3.0  # times the largest error over them
_FIT_SEED = 1
_CHECK_SEED = 2
_NOT_OF_CONTACT = ("fruit.E_MPa", "fruit.E_max_MPa", "fruit.bruise_limit_MPa", "fruit.poisson_spread", "tips.gap_mm")
_SMOOTH = (
    "fruit.length_mm", "fruit.width_mm", "fruit.height_mm", "tips.spacing_mm", "tips.side_mm", "fruit.poisson"
)  # fmt: skip
# Of a rigid flat tip of side 1 on a half-space, times E / (1 - nu^2) per force; the square as solve/halfspace has it.
_SQUARE_COMPLIANCE = 1.0 / 1.152302
_CIRCLE_COMPLIANCE = 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class InterpolatedContact:
    """Solved scenes of a study: `fractions` of the spans of `keys` (scenes, keys), `remainders` (scenes, entries of S).

    `error` [1] is that of s11 - s12 over scenes that were not fitted, with its safety; `solve_error` and `own_error`
    [1] are the largest of the solves, of which there are `solves`.
    """

    keys: tuple[str, ...]
    fractions: Floats
    remainders: Floats
    error: float
    solve_error: float
    own_error: float
    solves: int

    def covers(self, scene: UnitScene) -> bool:
        """Say whether a scene of the study lies where the solves are exact."""
        try:
            check_domain(scene.fruit, tip_footprints(scene.tips))
        except SplitDomainError:
            return False
        return True

    def compliance(self, scene: UnitScene, study: Study, point: Point) -> FruitCompliance:
        """Return the compliance of the scene of a point in its size [1/mm]."""
        (entries,) = self._interpolator(np.array([fractions_of(study, self.keys, point)]))
        count = len(scene.tips.names)
        remainder = np.zeros((count, count))
        remainder[np.tril_indices(count)] = entries
        remainder += np.tril(remainder, -1).T
        S = half_space(scene) + remainder * scene.tips.side_mm / scene.fruit.height_mm
        info = SolveInfo(
            method="split, interpolated",
            dofs=0,
            seconds=0.0,
            status=f"radial functions through {self.solves} solves, off by at most {self.error:.1e}",
        )
        return FruitCompliance(
            tips=scene.tips.names,
            S=S / (scene.scale * scene.tips.side_mm),
            error_pair=self.solve_error + self.error,
            error_own=self.own_error + self.error,
            info=info,
        )

    @functools.cached_property
    def _interpolator(self) -> RBFInterpolator:
        return RBFInterpolator(self.fractions, self.remainders, kernel="quintic", degree=3)


def contact_keys(study: Study) -> tuple[str, ...]:
    """Return the keys that vary and that contact depends on."""
    return tuple(key for key in study.vary if key.startswith(("fruit.", "tips.")) and key not in _NOT_OF_CONTACT)


def may_interpolate(study: Study, count: int) -> bool:
    """Say whether the contact of a study with so many points is interpolated; raises InputError where it cannot be.

    It may where flat tips on a block vary by spans of lengths and Poisson's ratio, at the level of contact; unless it
    is asked for, there must be many scenes.
    """
    keys = contact_keys(study)
    smooth = bool(keys) and all(key in _SMOOTH and isinstance(study.vary[key], Span) for key in keys)
    if smooth and study.level == "contact":
        middle = unit_scene(design_of(study, point_at(study, 0, [0.5] * len(study.vary)).settings))
        smooth = middle.fruit.shape == "block" and middle.tips.tip_shape.has_flat_face and middle.tips.fillet_mm == 0.0
    possible = smooth and study.level == "contact"
    if study.contact == "surrogate" and not possible:
        bound = "solve, unless flat tips on a block vary by spans of lengths and Poisson's ratio at the level contact"
        msg = f"contact = 'surrogate': must be {bound}; set contact = 'solve'"
        raise InputError(msg, field="contact", value="surrogate", bound=bound)
    asked = study.contact == "surrogate"
    many = study.contact == "auto" and study.how == "sobol" and count >= FEWEST_POINTS
    return possible and (asked or many)


def drawn_points(study: Study, count: int, seed: int) -> Iterator[Point]:
    """Yield points of a study inside the domain of the split, drawn apart from its own by a seed of their own.

    They crowd at the ends of the spans as the zeros of a Chebyshev polynomial do: there an interpolation errs most.
    """
    sequence = qmc.Sobol(len(study.vary), scramble=True, rng=study.seed + seed)
    for number, fractions in enumerate(sequence.random(count).tolist()):
        point = point_at(study, number, [0.5 - 0.5 * math.cos(math.pi * fraction) for fraction in fractions])
        try:
            scene = unit_scene(design_of(study, point.settings))
            check_domain(scene.fruit, tip_footprints(scene.tips))
        except (InputError, SplitDomainError):
            continue
        yield point


def fit_points(study: Study, count: int) -> list[Point]:
    """Return the points whose scenes are solved for an interpolation of so many, and behind them those to check it."""
    return [*drawn_points(study, count, _FIT_SEED), *drawn_points(study, CHECKED, _CHECK_SEED)]


def interpolated(study: Study, points: Sequence[Point], solved: Sequence[FruitCompliance]) -> InterpolatedContact:
    """Return the interpolation through all but the last solved scenes, those of `fit_points`, its error over these."""
    checks = len(list(drawn_points(study, CHECKED, _CHECK_SEED)))
    keys = contact_keys(study)
    scenes = [unit_scene(design_of(study, point.settings)) for point in points]
    remainders = []
    for scene, contact in zip(scenes, solved, strict=True):
        S = contact.S * scene.scale * scene.tips.side_mm
        rest = (S - half_space(scene)) * scene.fruit.height_mm / scene.tips.side_mm
        remainders.append(rest[np.tril_indices(len(rest))])
    model = InterpolatedContact(
        keys=keys,
        fractions=np.array([fractions_of(study, keys, point) for point in points[:-checks]]),
        remainders=np.array(remainders[:-checks]),
        error=0.0,
        solve_error=max(contact.error_pair for contact in solved),
        own_error=max(contact.error_own for contact in solved),
        solves=len(solved),
    )
    miss = 0.0
    for point, scene, contact in zip(points[-checks:], scenes[-checks:], solved[-checks:], strict=True):
        K = model.compliance(scene, study, point).K_m_over_E()
        miss = max(miss, abs(K / contact.K_m_over_E() - 1.0))
    return replace(model, error=SAFETY * miss)


def fractions_of(study: Study, keys: Sequence[str], point: Point) -> list[float]:
    """Return where the settings of a point lie in the spans of some keys [1]."""
    fractions = []
    for key in keys:
        span = study.vary[key]
        value: Setting = point.settings[key]
        if isinstance(span, Span) and isinstance(value, int | float):
            fractions.append(span.fraction_of(value))
    return fractions


def half_space(scene: UnitScene) -> Floats:
    """Return S of the tips on a half-space, far tips as points, times their side [1], shape (tips, tips)."""
    positions = np.array(scene.tips.places_mm) / scene.tips.side_mm
    distance = np.linalg.norm(positions[:, None] - positions[None, :], axis=2)
    np.fill_diagonal(distance, 1.0)
    factor = 1.0 - scene.fruit.poisson**2
    S = factor / (math.pi * distance)
    np.fill_diagonal(S, factor * (_CIRCLE_COMPLIANCE if scene.tips.tip_shape.is_round else _SQUARE_COMPLIANCE))
    return np.asarray(S)

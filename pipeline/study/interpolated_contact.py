"""Contact interpolated between solved scenes: the half-space in closed form, the smooth rest by radial functions.

S of a block under flat tips of side 1 is that of the half-space, (1 - nu^2) / (pi r) from tip to tip, and a remainder
that the free sides and the base make. Far from base and sides a tip is a point, so that the remainder goes with
1 / height: times the height it is a smooth function of the lengths and of Poisson's ratio, which SciPy interpolates.
"""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.stats import qmc

from cad.quantity import InputError, validation_error
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
_FRACTION = 0.5  # of the study's tolerance that interpolation may take: the other half is for the solves
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
    """Solved scenes of a study: `fractions` of the spans (scenes, keys), their `remainders` (scenes, entries of S) [1].

    `error` [1] is that of s11 - s12 over scenes that were not fitted, with its safety; `solve_error` and `own_error`
    [1] are the largest of the solves, of which there are `solves`.
    """

    spans: dict[str, Span]
    fractions: Floats
    remainders: Floats
    error: float
    solve_error: float
    own_error: float
    solves: int

    def compliance(self, scene: UnitScene, settings: Mapping[str, Setting]) -> FruitCompliance:
        """Return the compliance in its size [1/mm] of the scene that some settings of the study make."""
        half_space = half_space_compliance(scene)
        (remainder,) = self._interpolator([_fractions_of(self.spans, settings)])
        side_over_height = scene.tips.side_mm / scene.fruit.height_mm
        S = half_space + side_over_height * remainder.reshape(half_space.shape)
        info = SolveInfo(
            method="split, interpolated",
            dofs=0,
            seconds=0.0,
            status=f"radial functions through {self.solves} solves, off by at most {self.error:.1e}",
        )
        return FruitCompliance(
            tips=scene.tips.names,
            S=S / scene.side_mm,
            error_pair=self.solve_error + self.error,
            error_own=self.own_error + self.error,
            info=info,
        )

    @functools.cached_property
    def _interpolator(self) -> RBFInterpolator:
        return RBFInterpolator(self.fractions, self.remainders, kernel="quintic", degree=3)


def _fractions_of(spans: Mapping[str, Span], settings: Mapping[str, Setting]) -> list[float]:
    """Return where the settings of a point lie in spans [1]."""
    return [span.fraction_of(cast("float", settings[key])) for key, span in spans.items()]


def half_space_compliance(scene: UnitScene) -> Floats:
    """Return S of the tips on a half-space, far tips as points, times their side [1], shape (tips, tips)."""
    positions = np.array(scene.tips.places_mm) / scene.tips.side_mm
    distance = np.linalg.norm(positions[:, None] - positions[None, :], axis=2)
    np.fill_diagonal(distance, 1.0)
    factor = 1.0 - scene.fruit.poisson**2
    S = factor / (math.pi * distance)
    np.fill_diagonal(S, factor * (_CIRCLE_COMPLIANCE if scene.tips.tip_shape.is_round else _SQUARE_COMPLIANCE))
    return np.asarray(S)


def is_covered(scene: UnitScene) -> bool:
    """Say whether a scene lies where the solves are exact, and is flesh alone."""
    if scene.fruit.skin_mm is not None:
        return False
    try:
        check_domain(scene.fruit, tip_footprints(scene.tips))
    except SplitDomainError:
        return False
    return True


def contact_keys(study: Study) -> tuple[str, ...]:
    """Return the keys that vary and that contact depends on."""
    return tuple(key for key in study.vary if key.startswith(("fruit.", "tips.")) and key not in _NOT_OF_CONTACT)


def may_interpolate(study: Study, count: int) -> bool:
    """Say whether the contact of a study with so many points is interpolated; raises InputError where it cannot be.

    It may where flat tips on a block vary by spans of lengths and Poisson's ratio, at the level of contact; unless it
    is asked for, there must be many scenes.
    """
    possible = study.level == "contact" and _is_smooth(study)
    if study.contact == "surrogate":
        if not possible:
            bound = "auto or solve, unless flat tips on a block vary by spans of lengths and Poisson's ratio"
            raise validation_error("contact", study.contact, "", bound, "ask for keys of the level contact alone")
        return True
    return possible and study.contact == "auto" and study.how == "sobol" and count >= FEWEST_POINTS


def _is_smooth(study: Study) -> bool:
    """Say whether contact is a smooth function of what varies."""
    keys = contact_keys(study)
    if not keys or not all(key in _SMOOTH and isinstance(study.vary[key], Span) for key in keys):
        return False
    middle = design_of(study, point_at(study, 0, [0.5] * len(study.vary)).settings)
    return middle.fruit.shape == "block" and middle.tips.tip_shape.has_flat_face and middle.tips.fillet_mm == 0.0


def drawn_points(study: Study, count: int, seed: int) -> list[Point]:
    """Return points of a study inside the domain of the split, drawn apart from its own by a seed of their own.

    They crowd at the ends of the spans as the zeros of a Chebyshev polynomial do: there an interpolation errs most.
    More of them begin with the same ones.
    """
    points = []
    sequence = qmc.Sobol(len(study.vary), scramble=True, rng=study.seed + seed)
    for number, fractions in enumerate(sequence.random(count)):
        point = point_at(study, number, (0.5 - 0.5 * np.cos(np.pi * fractions)).tolist())
        try:
            scene = unit_scene(design_of(study, point.settings))
        except InputError:
            continue
        if is_covered(scene):
            points.append(point)
    return points


def fitted_contact(
    study: Study, solve: Callable[[Sequence[Point]], list[FruitCompliance]]
) -> InterpolatedContact | None:
    """Return the interpolation through as few solved scenes as do, None where none is good enough.

    `solve` returns the compliances of the scenes of some points. Raises InputError where an interpolation is asked for.
    """
    spans = {key: span for key in contact_keys(study) if isinstance(span := study.vary[key], Span)}
    check_points = drawn_points(study, CHECKED, _CHECK_SEED)
    check_contacts = solve(check_points)
    contacts: list[FruitCompliance] = []
    for count in SCENES:
        points = drawn_points(study, count, _FIT_SEED)
        contacts += solve(points[len(contacts) :])
        solved = [*contacts, *check_contacts]
        remainders = [_remainder(study, point, contact) for point, contact in zip(points, contacts, strict=True)]
        model = InterpolatedContact(
            spans=spans,
            fractions=np.array([_fractions_of(spans, point.settings) for point in points]),
            remainders=np.array(remainders),
            error=0.0,
            solve_error=max(contact.error_pair for contact in solved),
            own_error=max(contact.error_own for contact in solved),
            solves=len(solved),
        )
        misses = [_miss(study, model, point, truth) for point, truth in zip(check_points, check_contacts, strict=True)]
        model = replace(model, error=SAFETY * max(misses))
        if model.error <= _FRACTION * study.tol:
            return model
    if study.contact == "surrogate":
        bound = f"auto or solve, as no interpolation is within half of tol = {study.tol:g}"
        raise validation_error("contact", study.contact, "", bound, "narrow the spans, or allow a larger tol")
    return None


def _remainder(study: Study, point: Point, contact: FruitCompliance) -> Floats:
    """Return what the free sides and the base add to S of the half-space, times the height, (entries of S) [1]."""
    scene = unit_scene(design_of(study, point.settings))
    height_over_side = scene.fruit.height_mm / scene.tips.side_mm
    remainder = contact.S * scene.side_mm - half_space_compliance(scene)
    return np.ravel(height_over_side * remainder)


def _miss(study: Study, model: InterpolatedContact, point: Point, truth: FruitCompliance) -> float:
    """Return by how much the interpolated K_m / E of a point is off [1]."""
    scene = unit_scene(design_of(study, point.settings))
    return abs(model.compliance(scene, point.settings).K_m_over_E() / truth.K_m_over_E() - 1.0)

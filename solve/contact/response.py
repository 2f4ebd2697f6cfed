"""Forces over travel and modulus for any scene: the linear law where it is exact, unilateral contact elsewhere."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from solve.contact.linear_response import Response, linear_response
from solve.contact.scene import Cells, Scene, approach, scene_cells
from solve.contact.unilateral import Touch, UnilateralContact
from solve.fruit.compliance import Compliance

Floats = NDArray[np.float64]

# Times the step from the coarse grid: at order 1.5 the fine grid is 1.4 of that step away from the limit.
SAFETY = 1.5
# Over the number of touching cells: how far the rim of contact, which runs through cells, moves the force of a sphere.
RIM = 0.15


@dataclass(frozen=True, kw_only=True)
class SceneResponse:
    """One Response per modulus, how they were found, and their errors of shape (moduli, travels).

    `error_percent` is that of the forces of the tips that touch, `P_error_percent` that of P: of the cells, from a
    coarser grid, and of the compliance; nan where nothing touches, or one tip is off. What small slopes leave out is
    not in them: the status states it.
    """

    responses: tuple[Response, ...]
    error_percent: Floats
    P_error_percent: Floats
    method: str
    cells: int
    seconds: float
    status: str


def scene_response(
    scene: Scene, compliance: Compliance, C: Floats, E: Sequence[float], x: Floats | Sequence[float]
) -> SceneResponse:
    """Return forces, P and slope ratio at every modulus E [MPa] and travel x [mm] of the midpoint of the tips.

    C (2, 2) [mm/N] is the compliance of the springs, low tip first. P is nan where a tip is off. Raises InputError
    where the scene is too steep or outside the domain of contact, SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    S, C, x = np.array(compliance.S), np.asarray(C, dtype=np.float64), np.asarray(x, dtype=np.float64)
    known = np.full((len(E), len(x)), compliance.error_percent)
    if scene.linear:
        responses = tuple(linear_response(S, C, modulus, x) for modulus in E)
        touched = np.array([one.F_h + one.F_l > 0.0 for one in responses])
        status = "flat level faces: exact from the compliance for every modulus and travel"
        cells = 0
        errors = np.where(touched, known, np.nan), np.where(np.isfinite([one.P for one in responses]), known, np.nan)
    else:
        coarse, fine = scene_cells(scene, S, float(x.max(initial=0.0)))
        responses, rim = _pressed(scene, fine, C, E, x)
        errors = _errors(_pressed(scene, coarse, C, E, x)[0], responses, compliance.error_percent + 100.0 * rim)
        cells = len(fine.gap)
        status = _status(scene, cells)
    return SceneResponse(
        responses=responses,
        error_percent=errors[0],
        P_error_percent=errors[1],
        method="linear" if scene.linear else "unilateral",
        cells=cells,
        seconds=time.perf_counter() - start,
        status=status,
    )


def _pressed(
    scene: Scene, cells: Cells, C: Floats, E: Sequence[float], x: Floats
) -> tuple[tuple[Response, ...], Floats]:
    """Return the responses, and the relative error that the rim of contact leaves (moduli, travels)."""
    contact = UnilateralContact(cells.footprints)
    entered = [approach(scene, cells, float(travel)) for travel in x]
    responses, rims = [], []
    for modulus in E:
        touches = [contact.press(one, modulus * C + cells.missing) for one in entered]
        F = modulus * np.array([touch.F for touch in touches]).reshape(len(x), 2)
        rate = np.array([touch.slope for touch in touches]).reshape(len(x), 2)
        both = (F > 0.0).all(axis=1)
        P, slope = (np.divide(f[:, 1], f[:, 0], out=np.full(len(x), np.nan), where=both) for f in (F, rate))
        responses.append(Response(E=modulus, x=x, F_l=F[:, 0], F_h=F[:, 1], P=P, slope_ratio=slope))
        rims.append([_rim(cells, touch) for touch in touches])
    return tuple(responses), np.array(rims).reshape(len(E), len(x))


def _rim(cells: Cells, touch: Touch) -> float:
    """Return the larger error of a tip that touches with part of its face."""
    owner, count = cells.footprints.owner, len(cells.footprints.centres)
    touching = np.bincount(owner, touch.pressure > 0.0, minlength=count)
    faces = np.bincount(owner, np.isfinite(touch.gap), minlength=count)
    partly = (touching > 0) & (touching < faces)
    return float(np.max(RIM / touching[partly], initial=0.0))


def _errors(coarse: Sequence[Response], fine: Sequence[Response], known: Floats) -> tuple[Floats, Floats]:
    """Return the errors of forces and P [percent], from their step to the coarse grid and that of the compliance."""
    forces = [np.array([[one.F_l, one.F_h] for one in table]) for table in (coarse, fine)]
    touching = forces[1] > 0.0
    step = np.divide(np.abs(forces[1] - forces[0]), forces[1], out=np.full(forces[1].shape, -1.0), where=touching)
    worst = step.max(axis=1)
    ratio = [np.array([one.P for one in table]) for table in (coarse, fine)]
    # a tip that is off on the coarse grid alone has its whole force in doubt
    other = np.where(np.isnan(ratio[0]), 2.0 * ratio[1], ratio[0])
    changes = worst, np.nan_to_num(np.abs(ratio[1] / other - 1.0))
    # steps change sign along the table: the largest among a value's neighbours is no accidental zero
    force, P = (100.0 * SAFETY * maximum_filter(one, size=3) + known for one in changes)
    return np.where(touching.any(axis=1), force, np.nan), np.where(np.isnan(ratio[1]), np.nan, P)


def _status(scene: Scene, cells: int) -> str:
    parts = [f"unilateral contact on {cells} cells, error from a coarser grid"]
    if scene.fruit.shape != "block":
        low, high = scene.slopes_deg
        parts.append(f"the fruit slopes by {low:.3g} and {high:.3g} deg under the tips")
    omitted = 100.0 * (1.0 / np.cos(np.radians(scene.steepest_deg)) - 1.0)
    if omitted > 0.0:
        parts.append(
            f"tips meet the fruit at up to {scene.steepest_deg:.3g} deg, as a small slope: {omitted:.2g} % open"
        )
    return "; ".join(parts)

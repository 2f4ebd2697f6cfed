"""Forces over travel and modulus for any scene: the linear law where it is exact, that of domes, or contact cells."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter

from cad.quantity import validation_error
from solve.arrays import Floats
from solve.contact.domes.law import domes_on
from solve.contact.linear_response import SensorResponse, TipKinds, linear_response, response_of_forces
from solve.contact.scene import Scene, check_scene, joined
from solve.contact.scene_cells import SceneCells, interference, scene_cells
from solve.contact.unilateral import ContactState, UnilateralContact
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

# Times the step from the coarse grid: at order 1.5 the fine grid is 1.4 of that step away from the limit.
# Both numbers: tests/fits/contact_cells.py
SAFETY = 1.5
# Over the number of touching cells: how far the rim of contact, which runs through cells, moves the force of a sphere.
RIM = 0.15


def scene_response(
    scene: Scene,
    compliance: FruitCompliance,
    C: Floats,
    E: Sequence[float] | Floats,
    x: Sequence[float] | Floats,
    kinds: TipKinds | None = None,
) -> SensorResponse:
    """Return forces, P and slope ratio at every modulus E [MPa] and travel x [mm] of the mean of the tips' centres.

    C (tips, tips) [mm/N] is the compliance of the springs, whose kinds are those of the scene's tips where `kinds` is
    not given. The errors are those of the cells, from a coarser grid, or of the law of domes, and of the compliance;
    what small slopes leave out is not in them: the status states it. Raises InputError where the scene is too steep,
    outside the domain of contact or a contact runs off the face of a dome, SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    C, moduli, x = (np.asarray(values, dtype=np.float64) for values in (C, E, x))
    known = compliance.error_pair
    kinds = TipKinds(*scene.tips.kinds) if kinds is None else kinds
    if scene.linear:
        exact = linear_response(compliance.S, C, moduli, x, scene.ahead, kinds=kinds)
        return replace(exact, F_error=exact.F_error + known, P_error=exact.P_error + known)
    if scene.tips.tip_shape.obeys_hertz:
        return _of_domes(scene, compliance, C, (moduli, x), kinds)
    response = _on_cells(scene, compliance, C, (moduli, x), kinds)
    status = _status(scene, response.cells)
    return replace(response, info=replace(response.info, seconds=time.perf_counter() - start, status=status))


def _on_cells(
    scene: Scene, compliance: FruitCompliance, C: Floats, over: tuple[Floats, Floats], kinds: TipKinds
) -> SensorResponse:
    """Return the response on cells, over moduli and travels; raises as `scene_response`."""
    moduli, x = over
    grids = scene_cells(scene, compliance, float(x.max(initial=0.0)))
    coarse, fine = (_on_grid(scene, grid, C, moduli, x, kinds) for grid in grids)
    force_step, largest_P_step = _largest_steps(coarse, fine)
    return replace(
        fine,
        F_error=fine.F_error + SAFETY * force_step + compliance.error_pair,
        P_error=fine.P_error + SAFETY * largest_P_step + compliance.error_pair,
        P_step=1.0 - coarse.P / fine.P,
    )


def _of_domes(
    scene: Scene, compliance: FruitCompliance, C: Floats, over: tuple[Floats, Floats], kinds: TipKinds
) -> SensorResponse:
    """Return the response of domes by their law, over moduli and travels; raises as `scene_response`."""
    start = time.perf_counter()
    check_scene(scene)
    moduli, x = over
    E, travel = (values.ravel() for values in np.meshgrid(moduli, x, indexing="ij"))
    domes = domes_on(scene, compliance, C, [scene] * len(E), E, travel)
    _check_face(scene, float(domes.face.max(initial=0.0)))
    shape = (len(moduli), len(x), len(C))
    F, rates, relative = (values.reshape(shape) for values in (domes.F, domes.rates, domes.relative_error))
    seconds = time.perf_counter() - start
    info = SolveInfo(method="domes", dofs=0, seconds=seconds, status=_dome_status(scene))
    response = response_of_forces(moduli, x, F, rates, kinds, info)
    error = relative.max(axis=2)
    return replace(response, F_error=response.F_error + error, P_error=response.P_error + 2.0 * error)


def _check_face(scene: Scene, needed: float) -> None:
    """Raise InputError where a contact needs a wider face [mm] than the domes have."""
    if needed > scene.tips.side_mm:
        bound = f"at least {needed:.3g} mm, or the contact runs off the face of a dome"
        raise validation_error(
            "tips.side_mm", scene.tips.side_mm, "mm", bound, "widen the face, or press more level or less deep"
        )


def _dome_status(scene: Scene) -> str:
    return (
        "Hertz's law where each dome touches, at any tilt without a small-angle approximation; the fruit slopes by "
        f"{joined(scene.slopes_deg)} deg under the tips; friction and large strain are left out"
    )


def _on_grid(scene: Scene, grid: SceneCells, C: Floats, moduli: Floats, x: Floats, kinds: TipKinds) -> SensorResponse:
    """Return the response on one grid; its errors [1] are the rim's."""
    contact = UnilateralContact(grid.cells)
    entered = [interference(scene, grid, float(travel)) for travel in x]
    shape = (len(moduli), len(x), len(C))
    F, rates, rim = np.zeros(shape), np.zeros(shape), np.zeros(shape[:2])
    for i, modulus in enumerate(moduli):
        for j, depth in enumerate(entered):
            state = contact.solve(depth, modulus * C + grid.compliance_correction)
            F[i, j], rates[i, j], rim[i, j] = modulus * state.F, state.slope, _rim(grid, state)
    info = SolveInfo(method="unilateral", dofs=len(grid.gap), seconds=0.0, status="one grid")
    response = response_of_forces(moduli, x, F, rates, kinds, info)
    return replace(response, F_error=response.F_error + rim, P_error=response.P_error + rim)


def _rim(grid: SceneCells, state: ContactState) -> float:
    """Return the largest error of a tip that touches with part of its face [1]."""
    owner, count = grid.cells.owner, len(grid.cells.centres)
    touching = np.bincount(owner, state.pressure > 0.0, minlength=count)
    faces = np.bincount(owner, np.isfinite(state.gap), minlength=count)
    partly = (touching > 0) & (touching < faces)
    return float(np.max(RIM / touching[partly], initial=0.0))


def _largest_steps(coarse: SensorResponse, fine: SensorResponse) -> tuple[Floats, Floats]:
    """Return the relative steps [1] of forces and of P from a coarse to a fine grid, the largest among neighbours.

    Shape (moduli, travels); steps change sign along the table, so that a step of zero may be an accident.
    """
    touching = fine.F > 0.0
    force = np.divide(np.abs(fine.F - coarse.F), fine.F, out=np.full(fine.F.shape, -1.0), where=touching)
    # a tip that is off on the coarse grid alone has its whole force in doubt
    coarse_P = np.where(np.isnan(coarse.P), 2.0 * fine.P, coarse.P)
    steps = force.max(axis=2), np.nan_to_num(np.abs(fine.P / coarse_P - 1.0))
    return maximum_filter(steps[0], size=3), maximum_filter(steps[1], size=3)


def _status(scene: Scene, cells: int) -> str:
    parts = [f"unilateral contact on {cells} cells, error from a coarser grid"]
    if scene.fruit.shape != "block":
        parts.append(f"the fruit slopes by {joined(scene.slopes_deg)} deg under the tips")
    steepest = scene.steepest_deg + scene.tips.tip_shape.flank_deg
    omitted = 100.0 * (1.0 / np.cos(np.radians(steepest)) - 1.0)
    if omitted > 0.0:
        parts.append(f"tips meet the fruit at up to {steepest:.3g} deg, as a small slope: {omitted:.2g} % open")
    return "; ".join(parts)

"""Forces over travel and modulus for any scene: the linear law where it is exact, that of domes, or contact cells."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import validation_error
from solve.contact.domes.body import dome_body
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.linear_response import SensorResponse, TipForces, linear_response, response_of_forces
from solve.contact.scene import Scene, check_scene, values_in_words
from solve.contact.scene_cells import SceneCells, naming_the_skin, scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

# Times the step from the coarse grid: at order 1.5 the fine grid is 1.4 of that step away from the limit.
# Both numbers: tests/reference/fits/test_contact.py
SAFETY = 1.5
# Over the number of touching cells: how far the rim of contact, which runs through cells, moves the force of a sphere.
RIM = 0.15


def scene_response(
    scene: Scene, compliance: FruitCompliance, C: Floats, E: Sequence[float] | Floats, x: Sequence[float] | Floats
) -> SensorResponse:
    """Return forces, P and slope ratio at every modulus E [MPa] and travel x [mm] of the mean of the tips' centres.

    C (tips, tips) [mm/N] is the compliance of the springs. The errors are those of the compliance, and of the cells,
    from a coarser grid, or of the law of domes. What small slopes leave out is not in them: the status states it.
    Raises InputError where the scene is too steep or outside the domain of contact, or where a contact runs off the
    face of a dome. Raises SolveError when a solve is not exact.
    """
    C = np.asarray(C, dtype=np.float64)
    moduli = np.asarray(E, dtype=np.float64)
    x = np.asarray(x, dtype=np.float64)
    if compliance.skin is not None:
        return _joined([scene_response(scene, compliance.at(each), C, [each], x) for each in moduli.tolist()])
    if scene.linear:
        exact = linear_response(compliance.S, C, moduli, x, scene.height_offsets_mm, scene.tips.spring_groups)
        error = compliance.error_pair
        return replace(exact, F_error=exact.F_error + error, P_error=exact.P_error + error)
    if scene.on_domes:
        return _dome_response(scene, compliance, C, moduli, x)
    with naming_the_skin(scene, compliance):
        return _cell_response(scene, compliance, C, moduli, x)


def _joined(responses: Sequence[SensorResponse]) -> SensorResponse:
    """Return responses to the same travels, each at its own moduli, as one."""
    columns: dict[str, Any] = {}
    for name in ("E", "F", "P", "slope_ratio", "F_error", "P_error", "P_step", "mean_pressure"):
        values = [getattr(response, name) for response in responses]
        columns[name] = None if values[0] is None else np.concatenate(values)
    seconds = sum(response.info.seconds for response in responses)
    return replace(responses[0], **columns, info=replace(responses[0].info, seconds=seconds))


def _cell_response(scene: Scene, compliance: FruitCompliance, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response on the finer of two grids of cells, its errors from both; raises as `scene_response`."""
    start = time.perf_counter()
    coarse_grid, fine_grid = scene_cells(scene, compliance, float(x.max(initial=0.0)))
    coarse = _grid_response(scene, coarse_grid, C, moduli, x)
    fine = _grid_response(scene, fine_grid, C, moduli, x)

    touching = fine.F > 0.0
    force_steps = np.divide(np.abs(fine.F - coarse.F), fine.F, out=np.full(fine.F.shape, -1.0), where=touching)
    # a tip that is off on the coarse grid alone has its whole force in doubt
    coarse_P = np.where(np.isnan(coarse.P), 2.0 * fine.P, coarse.P)
    P_steps = np.nan_to_num(np.abs(fine.P / coarse_P - 1.0))
    # Steps change sign along the table: a step of zero may be an accident, the largest among neighbours counts.
    force_step = _largest_near(force_steps.max(axis=2))
    P_step = _largest_near(P_steps)
    return replace(
        fine,
        F_error=fine.F_error + SAFETY * force_step + compliance.error_pair,
        P_error=fine.P_error + SAFETY * P_step + compliance.error_pair,
        P_step=1.0 - coarse.P / fine.P,
        info=replace(fine.info, seconds=time.perf_counter() - start, status=_cell_status(scene, fine.cells)),
    )


def _largest_near(table: Floats) -> Floats:
    """Return a table of two dimensions in which each value is the largest of itself and its neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(table, 1, mode="edge"), (3, 3))
    return np.asarray(windows.max(axis=(2, 3)))


def _cell_status(scene: Scene, cells: int) -> str:
    """Return in words how a response on cells was computed, and what small slopes leave out of it."""
    status = f"unilateral contact on {cells} cells, error from a coarser grid"
    if scene.fruit.shape != "block":
        status += f"; the fruit slopes by {values_in_words(scene.slopes_deg)} deg under the tips"
    steepest = scene.steepest_deg + scene.tips.tip_shape.flank_deg
    omitted = 100.0 * (1.0 / np.cos(np.radians(steepest)) - 1.0)
    if omitted > 0.0:
        status += f"; tips meet the fruit at up to {steepest:.3g} deg, as a small slope: {omitted:.2g} % open"
    return status


def _dome_response(scene: Scene, compliance: FruitCompliance, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response of domes by their law; raises as `scene_response`."""
    start = time.perf_counter()
    check_scene(scene)
    # The law takes one modulus and one travel for each press.
    E, travel = (values.ravel() for values in np.meshgrid(moduli, x, indexing="ij"))
    body = dome_body(scene, compliance, [scene.fruit] * len(E))
    domes = dome_forces(dome_poses([scene] * len(E), travel), E, C, body)
    _check_faces(scene, domes.face[min(scene.fruit.E_MPa) <= E])
    status = (
        "Hertz's law at large strain where each dome touches, at any tilt without a small-angle approximation; the "
        f"fruit slopes by {values_in_words(scene.slopes_deg)} deg under the tips; friction is left out"
    )
    info = SolveInfo(method="domes", dofs=0, seconds=time.perf_counter() - start, status=status)
    shape = (len(moduli), len(x), len(C))
    forces = TipForces(domes.F.reshape(shape), domes.rates.reshape(shape))
    response = response_of_forces(moduli, x, forces, scene.tips.spring_groups, info)
    error = domes.relative_error.reshape(shape).max(axis=2)
    return replace(
        response,
        F_error=response.F_error + error,
        P_error=response.P_error + 2.0 * error,
        mean_pressure=domes.mean_pressure.reshape(shape),
    )


def _check_faces(scene: Scene, face: Floats) -> None:
    """Raise InputError where a contact on flesh of the fruit needs a wider face [mm] than the domes have.

    Flesh that is softer than any of the fruit is pressed for a limit alone, and is not in `face` (presses, tips).
    """
    widest = float(face.max(initial=0.0))
    if widest > scene.tips.side_mm:
        enough = math.ceil(100.0 * widest) / 100.0
        bound = f"at least {enough:g} mm, or the contact runs off the face of a dome"
        hint = "widen the face, or press more level or less deep"
        raise validation_error("tips.side_mm", scene.tips.side_mm, "mm", bound, hint)


def _grid_response(scene: Scene, grid: SceneCells, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response on one grid of cells; its errors [1] are those of the rim of the contact."""
    contact = UnilateralContact(grid.cells)
    interferences = [grid.interference(scene, float(travel)) for travel in x]
    F = np.zeros((len(moduli), len(x), len(C)))
    rates = np.zeros_like(F)
    rim = np.zeros(F.shape[:2])
    for i, modulus in enumerate(moduli):
        for j, interference in enumerate(interferences):
            # Contact is solved in forces over E [mm^2], so compliances are times E [1/mm].
            state = contact.solve(interference, modulus * C + grid.compliance_correction)
            F[i, j] = modulus * state.F
            rates[i, j] = state.slope
            # The rim runs through cells of a tip that touches with part of its face.
            tips = len(C)
            touching = np.bincount(grid.cells.owner, state.pressure > 0.0, minlength=tips)
            faces = np.bincount(grid.cells.owner, np.isfinite(state.gap), minlength=tips)
            partly = (touching > 0) & (touching < faces)
            rim[i, j] = np.max(RIM / touching[partly], initial=0.0)
    info = SolveInfo(method="unilateral", dofs=len(grid.gap), seconds=0.0, status="one grid")
    response = response_of_forces(moduli, x, TipForces(F, rates), scene.tips.spring_groups, info)
    return replace(response, F_error=response.F_error + rim, P_error=response.P_error + rim)

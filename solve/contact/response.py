"""Forces over travel and modulus for any scene: by the linear law, the law of domes, or contact cells."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import validation_error
from solve.contact.domes.fruit_under_domes import dome_body
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.linear_response import SensorResponse, TipForces, linear_response, response_of_forces
from solve.contact.scene import Scene, check_scene, values_in_words
from solve.contact.scene_cells import SceneCells, naming_the_skin, scene_cells
from solve.contact.unilateral import UnilateralContact
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

# Error over the step from the coarse to the fine grid; at order 1.5 the remaining error is 1.4 of this step.
# tests/solve/contact/test_response.py compares SAFETY and RIM with finer grids.
SAFETY = 1.5
# Relative error of a sphere's force times the number of touching cells: the rim of the contact runs through cells.
RIM = 0.15


def scene_response(
    scene: Scene, compliance: FruitCompliance, C: Floats, E: Sequence[float] | Floats, x: Sequence[float] | Floats
) -> SensorResponse:
    """Return forces, P and slope ratio at every modulus E [MPa] and travel x [mm] of the middle of the tips.

    C (tips, tips) [mm/N] is the compliance of the springs. The errors come from the compliance, and from a coarser grid
    of cells or from the law of domes. They leave out the error of small slopes, which the status states. Raises
    InputError if the scene is too steep or outside the domain of contact, or if a contact reaches the edge of a dome's
    face. Raises SolveError if a solve does not converge.
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
    """Return one response from several ones to the same travels, each at its own moduli."""
    columns: dict[str, Any] = {}
    for name in ("E", "F", "P", "slope_ratio", "F_error", "P_error", "P_step", "mean_pressure"):
        values = [getattr(response, name) for response in responses]
        columns[name] = None if values[0] is None else np.concatenate(values)
    seconds = sum(response.info.seconds for response in responses)
    return replace(responses[0], **columns, info=replace(responses[0].info, seconds=seconds))


def _cell_response(scene: Scene, compliance: FruitCompliance, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response on the finer of two grids of cells, with errors from both.

    The error is SAFETY times the step between the grids, plus the error of the rim and of the compliance. Raises
    InputError and SolveError like `scene_response`.
    """
    start = time.perf_counter()
    coarse_grid, fine_grid = scene_cells(scene, compliance, float(x.max(initial=0.0)))
    coarse = _grid_response(scene, coarse_grid, C, moduli, x)
    fine = _grid_response(scene, fine_grid, C, moduli, x)

    touching = fine.F > 0.0
    force_steps = np.divide(np.abs(fine.F - coarse.F), fine.F, out=np.full(fine.F.shape, -1.0), where=touching)
    # if a tip is out of contact on the coarse grid only, its whole force counts as uncertain
    coarse_P = np.where(np.isnan(coarse.P), 2.0 * fine.P, coarse.P)
    P_steps = np.nan_to_num(np.abs(fine.P / coarse_P - 1.0))
    # Steps change sign along the table, so a small step may be accidental: the largest of the neighbours is used.
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
    """Return a two-dimensional table in which each value is the largest of itself and its neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(table, 1, mode="edge"), (3, 3))
    return np.asarray(windows.max(axis=(2, 3)))


def _cell_status(scene: Scene, cells: int) -> str:
    """Return a text on the solution on cells, and on the error of small slopes."""
    status = f"unilateral contact on {cells} cells, error from a coarser grid"
    if scene.fruit.shape != "block":
        status += f"; the fruit slopes by {values_in_words(scene.slopes_deg)} deg under the tips"
    steepest = scene.steepest_deg + scene.tips.tip_shape.flank_deg
    omitted = 100.0 * (1.0 / np.cos(np.radians(steepest)) - 1.0)
    if omitted > 0.0:
        status += f"; tips meet the fruit at up to {steepest:.3g} deg, a small slope with an error of {omitted:.2g} %"
    return status


def _dome_response(scene: Scene, compliance: FruitCompliance, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response of domes by their law, with the error that the law gives.

    The errors of both forces add up in P. Raises InputError and SolveError like `scene_response`.
    """
    start = time.perf_counter()
    check_scene(scene)
    # The law of domes takes one modulus and one travel per press.
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
    """Raise InputError if a contact on the fruit needs a wider face [mm] than the domes have.

    `face` (presses, tips) [mm] leaves out flesh softer than that of the fruit, which is pressed only to find a limit.
    """
    widest = float(face.max(initial=0.0))
    if widest > scene.tips.side_mm:
        enough = math.ceil(100.0 * widest) / 100.0
        bound = f"at least {enough:g} mm, or the contact runs off the face of a dome"
        hint = "widen the face, or press more level or less deep"
        raise validation_error("tips.side_mm", scene.tips.side_mm, "mm", bound, hint)


def _grid_response(scene: Scene, grid: SceneCells, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response on one grid of cells.

    Its errors [1] come from the rim of the contact, which crosses cells that touch as a whole or not at all.
    """
    contact = UnilateralContact(grid.cells)
    interferences = [grid.interference(scene, float(travel)) for travel in x]
    F = np.zeros((len(moduli), len(x), len(C)))
    rates = np.zeros_like(F)
    rim = np.zeros(F.shape[:2])
    for i, modulus in enumerate(moduli):
        for j, interference in enumerate(interferences):
            # Contact is solved for forces over E [mm^2], so compliances are multiplied by E [1/mm].
            state = contact.solve(interference, modulus * C + grid.compliance_correction)
            F[i, j] = modulus * state.F
            rates[i, j] = state.slope
            # Only a tip that touches with part of its face has a rim that runs through cells.
            tips = len(C)
            touching = np.bincount(grid.cells.owner, state.pressure > 0.0, minlength=tips)
            faces = np.bincount(grid.cells.owner, np.isfinite(state.gap), minlength=tips)
            partly = (touching > 0) & (touching < faces)
            rim[i, j] = np.max(RIM / touching[partly], initial=0.0)
    info = SolveInfo(method="unilateral", dofs=len(grid.gap), seconds=0.0, status="one grid")
    response = response_of_forces(moduli, x, TipForces(F, rates), scene.tips.spring_groups, info)
    return replace(response, F_error=response.F_error + rim, P_error=response.P_error + rim)

"""The tip forces in any scene at all moduli and travels, from the linear law, the dome law or contact cells."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import validation_error
from solve.contact.domes.fruit_under_domes import fruit_under_domes
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.linear_response import SensorResponse, TipForces, linear_response, response_of_forces
from solve.contact.pressure_cells import ContactCells
from solve.contact.scene import Scene, check_scene, slopes_text
from solve.contact.scene_cells import SceneCells, explain_skin_error, scene_cells
from solve.contact.unilateral import ContactState, UnilateralContact
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance

# Ratio of the error bar to the difference between the coarse and the fine grid. With convergence of order 1.5, the
# error of the fine grid is 1.4 times this difference. tests/solve/contact/test_response.py checks SAFETY and RIM.
SAFETY = 1.5
# Relative error of the force on a sphere, times the number of touching cells. The edge of the contact, which crosses
# cells, causes this error.
RIM = 0.15


def scene_response(
    scene: Scene, compliance: FruitCompliance, C: Floats, E: Sequence[float] | Floats, x: Sequence[float] | Floats
) -> SensorResponse:
    """Return the forces, their ratio P and their slope ratio at all moduli E [MPa] and travels x [mm].

    `compliance` is the compliance of the fruit, and C (tips, tips) [mm/N] is the compliance of the springs. The error
    estimates cover the compliance of the fruit, and the grid of cells or the dome law. The estimates exclude the error
    of the small-slope approximation, which the status reports. Raises InputError if a tip meets the fruit at more than
    20 deg, or the scene is outside the domain of the contact solver. Also raises InputError if a contact reaches the
    edge of a dome's face, or the skin is too stiff or too soft for the model. Raises SolveError if a solve does not
    converge.
    """
    C = np.asarray(C, dtype=np.float64)
    moduli = np.asarray(E, dtype=np.float64)
    x = np.asarray(x, dtype=np.float64)
    if compliance.skin is not None:
        # Under a skin, the compliance differs for each modulus. `at` returns a compliance without a table, so this
        # branch is not entered again.
        return _join_responses([scene_response(scene, compliance.at(E_i), C, [E_i], x) for E_i in moduli.tolist()])
    if scene.obeys_linear_law:  # exact, so the only error is the error of the compliance
        response = linear_response(compliance.S, C, moduli, x, scene.height_offsets_mm, scene.tips.spring_groups)
        error = compliance.difference_error
        return replace(response, F_error=response.F_error + error, P_error=response.P_error + error)
    if scene.obeys_dome_law:
        return _dome_response(scene, compliance, C, moduli, x)
    with explain_skin_error(scene, compliance):
        return _cell_response(scene, compliance, C, moduli, x)


def _join_responses(responses: Sequence[SensorResponse]) -> SensorResponse:
    """Return one response that joins several responses at different moduli and the same travels.

    The wall-clock times are added. The travels, the number of cells and the status come from the first response.
    """
    joined_arrays: dict[str, Any] = {}
    # The first axis of these arrays is the modulus. `mean_pressure` is None unless the tips are domes.
    for name in ("E", "F", "P", "slope_ratio", "F_error", "P_error", "P_step", "mean_pressure"):
        values = [getattr(response, name) for response in responses]
        joined_arrays[name] = None if values[0] is None else np.concatenate(values)
    seconds = sum(response.info.seconds for response in responses)
    return replace(responses[0], **joined_arrays, info=replace(responses[0].info, seconds=seconds))


def _cell_response(scene: Scene, compliance: FruitCompliance, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response on the finer of two grids of cells, at the moduli [MPa] and travels x [mm].

    The error is SAFETY times the difference between the two grids, plus the errors that the edge of the contact and the
    compliance cause. C (tips, tips) [mm/N] is the compliance of the springs. Raises InputError if a tip meets the fruit
    at more than 20 deg, or the scene is outside the domain of the contact solver. Raises SolveError if a solve does not
    converge.
    """
    start = time.perf_counter()
    coarse_grid, fine_grid = scene_cells(scene, compliance, float(x.max(initial=0.0)))
    coarse_response = _grid_response(scene, coarse_grid, C, moduli, x)
    fine_response = _grid_response(scene, fine_grid, C, moduli, x)
    F_difference, P_difference = _response_differences(fine_response, coarse_response)
    info = fine_response.info
    status = _cell_status(scene, fine_response.cells)
    return replace(
        fine_response,
        F_error=fine_response.F_error + SAFETY * F_difference + compliance.difference_error,
        P_error=fine_response.P_error + SAFETY * P_difference + compliance.difference_error,
        P_step=1.0 - coarse_response.P / fine_response.P,
        info=replace(info, seconds=time.perf_counter() - start, status=status),
    )


def _response_differences(fine_response: SensorResponse, coarse_response: SensorResponse) -> tuple[Floats, Floats]:
    """Return the relative differences between two grids in the forces F and in their ratio P [1].

    Both have shape (moduli, travels). The difference in F is the largest one of all tips in contact. The differences
    change sign within the table, so a small value may be accidental. Each value is therefore replaced by the largest
    value among itself and its neighbours.
    """
    is_touching = fine_response.F > 0.0
    # A tip out of contact has the difference -1, which the maximum over tips ignores.
    F_differences = np.divide(
        np.abs(fine_response.F - coarse_response.F),
        fine_response.F,
        out=np.full(fine_response.F.shape, -1.0),
        where=is_touching,
    )
    # If a tip is out of contact only on the coarse grid, the coarse P is undefined. Twice the fine P replaces it, which
    # gives a large difference. If the fine P is undefined, the difference is 0.
    coarse_P = np.where(np.isnan(coarse_response.P), 2.0 * fine_response.P, coarse_response.P)
    P_differences = np.nan_to_num(np.abs(fine_response.P / coarse_P - 1.0))
    return _neighbour_maximum(F_differences.max(axis=2)), _neighbour_maximum(P_differences)


def _neighbour_maximum(table: Floats) -> Floats:
    """Return a two-dimensional table in which each value is the maximum of itself and its eight neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(table, 1, mode="edge"), (3, 3))
    return np.asarray(windows.max(axis=(2, 3)))


def _cell_status(scene: Scene, cells: int) -> str:
    """Return a status text for the report, with the number of cells and the error of the small-slope approximation."""
    status = f"unilateral contact on {cells} cells, error from a coarser grid"
    if scene.fruit.shape != "block":
        status += f"; the fruit slopes by {slopes_text(scene.slopes_deg)} deg under the tips"
    steepest = scene.steepest_deg + scene.tips.tip_shape.flank_deg
    # The small-slope approximation replaces the cosine of the angle by 1.
    percent = 100.0 * (1.0 / np.cos(np.radians(steepest)) - 1.0)
    if percent > 0.0:
        status += f"; tips meet the fruit at up to {steepest:.3g} deg, a small slope with an error of {percent:.2g} %"
    return status


def _dome_response(scene: Scene, compliance: FruitCompliance, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response of domes by the dome law, at the moduli [MPa] and travels x [mm].

    C (tips, tips) [mm/N] is the compliance of the springs. The error bounds are the bounds of the law. The relative
    error of P is twice the largest relative error of a force, because P is a ratio of two mean forces. Raises
    InputError if a tip meets the fruit at more than 20 deg, or a contact reaches the edge of a face. Raises SolveError
    if Newton's method does not converge.
    """
    start = time.perf_counter()
    check_scene(scene)
    # The dome law expects one modulus and one travel per press, so all pairs of both are solved as separate presses.
    modulus_grid, travel_grid = np.meshgrid(moduli, x, indexing="ij")
    E = modulus_grid.ravel()
    travel = travel_grid.ravel()
    fruit = fruit_under_domes(scene, compliance, [scene.fruit] * len(E))
    domes = dome_forces(dome_poses([scene] * len(E), travel), E, C, fruit)
    _check_faces(scene, domes.face[min(scene.fruit.E_MPa) <= E])  # only for moduli in the range of the fruit
    info = SolveInfo(method="domes", dofs=0, seconds=time.perf_counter() - start, status=_dome_status(scene))
    shape = (len(moduli), len(x), len(C))
    forces = TipForces(domes.F.reshape(shape), domes.rates.reshape(shape))
    response = response_of_forces(moduli, x, forces, scene.tips.spring_groups, info)
    largest_relative_error = domes.relative_error.reshape(shape).max(axis=2)
    return replace(
        response,
        F_error=response.F_error + largest_relative_error,
        P_error=response.P_error + 2.0 * largest_relative_error,
        mean_pressure=domes.mean_pressure.reshape(shape),
    )


def _dome_status(scene: Scene) -> str:
    """Return a status text for the report, with the law of the domes and the slopes of the fruit under the tips."""
    return (
        "Hertz's law at large strain where each dome touches, at any tilt without a small-angle approximation; the "
        f"fruit slopes by {slopes_text(scene.slopes_deg)} deg under the tips; friction is left out"
    )


def _check_faces(scene: Scene, face_diameters: Floats) -> None:
    """Raise InputError if a contact needs a wider tip face than the domes have.

    `face_diameters` (presses, tips) [mm] are the face diameters that the contacts need. The diameters should include
    only moduli in the fruit's range, because softer flesh is pressed only to find a limit. The message states a
    sufficient face.
    """
    needed_diameter = float(face_diameters.max(initial=0.0))
    if needed_diameter > scene.tips.side_mm:
        sufficient_side = math.ceil(100.0 * needed_diameter) / 100.0  # rounded up to 0.01 mm
        bound = f"at least {sufficient_side:g} mm, or the contact runs off the face of a dome"
        hint = "widen the face, or press more level or less deeply"
        raise validation_error("tips.side_mm", scene.tips.side_mm, "mm", bound, hint)


def _grid_response(scene: Scene, grid: SceneCells, C: Floats, moduli: Floats, x: Floats) -> SensorResponse:
    """Return the response on one grid of cells, at the moduli [MPa] and travels x [mm].

    C (tips, tips) [mm/N] is the compliance of the springs. A cell can only touch as a whole, so forces depend on where
    the edge of the contact crosses the cells. The errors of the response [1] estimate this effect.
    """
    contact = UnilateralContact(grid.cells)
    interferences = [grid.interference(scene, float(travel)) for travel in x]
    F = np.zeros((len(moduli), len(x), len(C)))
    rates = np.zeros_like(F)
    edge_error = np.zeros(F.shape[:2])
    for i, modulus in enumerate(moduli):
        for j, interference in enumerate(interferences):
            # Contact is solved for forces divided by E [mm^2], so compliances are multiplied by E [1/mm].
            solution = contact.solve(interference, modulus * C + grid.compliance_correction)
            F[i, j] = modulus * solution.F
            rates[i, j] = solution.slope  # divided by E; only ratios of these rates are used
            edge_error[i, j] = _edge_error(grid.cells, solution)
    info = SolveInfo(method="unilateral", dofs=len(grid.gap), seconds=0.0, status="one grid")
    response = response_of_forces(moduli, x, TipForces(F, rates), scene.tips.spring_groups, info)
    return replace(response, F_error=response.F_error + edge_error, P_error=response.P_error + edge_error)


def _edge_error(cells: ContactCells, solution: ContactState) -> float:
    """Return the largest relative error [1] of a force that arises because the edge of its contact crosses cells.

    The edge crosses cells only under tips whose face touches in part. The error is RIM divided by the number of
    touching cells. It is 0 if every face touches completely or not at all.
    """
    tip_count = len(cells.centres)
    touching_cells = np.bincount(cells.owner, solution.pressure > 0.0, minlength=tip_count)
    face_cells = np.bincount(cells.owner, np.isfinite(solution.gap), minlength=tip_count)
    is_partial = (touching_cells > 0) & (touching_cells < face_cells)
    return float(np.max(RIM / touching_cells[is_partial], initial=0.0))

"""Forces over travel and modulus for any scene: the linear law where it is exact, unilateral contact elsewhere."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter

from solve.arrays import Floats
from solve.contact.linear_response import PAIR, SensorResponse, TipKinds, linear_response, response_of_forces
from solve.contact.scene import Scene, joined
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
    kinds: TipKinds = PAIR,
) -> SensorResponse:
    """Return forces, P and slope ratio at every modulus E [MPa] and travel x [mm] of the mean of the tips' centres.

    C (tips, tips) [mm/N] is the compliance of the springs. The errors are those of the cells, from a coarser grid,
    and of the compliance; what small slopes leave out is not in them: the status states it. Raises InputError where
    the scene is too steep or outside the domain of contact, SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    C, moduli, x = (np.asarray(values, dtype=np.float64) for values in (C, E, x))
    known = compliance.error_pair
    if scene.linear:
        exact = linear_response(compliance.S, C, moduli, x, scene.ahead, kinds=kinds)
        return replace(exact, F_error=exact.F_error + known, P_error=exact.P_error + known)
    grids = scene_cells(scene, compliance, float(x.max(initial=0.0)))
    coarse, fine = (_on_grid(scene, grid, C, moduli, x, kinds) for grid in grids)
    force_step, largest_P_step = _largest_steps(coarse, fine)
    return replace(
        fine,
        F_error=fine.F_error + SAFETY * force_step + known,
        P_error=fine.P_error + SAFETY * largest_P_step + known,
        P_step=1.0 - coarse.P / fine.P,
        info=replace(fine.info, seconds=time.perf_counter() - start, status=_status(scene, fine.cells)),
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
    omitted = 100.0 * (1.0 / np.cos(np.radians(scene.steepest_deg)) - 1.0)
    if omitted > 0.0:
        parts.append(
            f"tips meet the fruit at up to {scene.steepest_deg:.3g} deg, as a small slope: {omitted:.2g} % open"
        )
    return "; ".join(parts)

"""Hard presses: travel, modulus, tilt, curvature, springs of very different stiffness."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from benchmarks.bars.check import ReferenceCheck, make_checks, try_reference
from benchmarks.harness import Reference
from pipeline.response.contact import contact_compliance
from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.quantity import InputError
from solve.contact.gap import tip_gap
from solve.contact.linear_response import spring_compliance
from solve.contact.pressure_cells import ContactCells, contact_cells, half_cells
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance
from solve.fruit.footprints import Footprint
from solve.halfspace.punch import graded_edges

ROUNDING = 1e-9  # relative tolerance for closed formulas
CELLS, CELLS_ROLLED = (22, 32), (16, 24)  # cells per side in the independent solution, other than the product's
GRADING = 2.0  # exponent with which the cells become smaller towards the edges of a tip
ORDER = 1.5  # order of convergence of cells with constant pressure at the edge of a flat tip
BLOCK, TIPS, PRESS = Fruit(), Tips(), PressMotion()
SPRINGS = (0.9057, 20.831)  # stiffness of the low and the high spring [N/mm]


@dataclass(frozen=True, kw_only=True)
class State:
    """A scene with the modulus of its flesh [MPa] and the stiffnesses of its springs [N/mm]."""

    scene: Scene
    E: float
    springs: Sequence[float]


def forces(state: State, compliance: FruitCompliance) -> tuple[Floats, float]:
    """Return the product's force on each tip [N] at full travel, and its relative error bar [1]."""
    C = spring_compliance(*state.springs)
    travel = state.scene.press.travel_mm
    response = scene_response(state.scene, compliance, C, [state.E], [travel])
    return response.F[0, 0], float(response.F_error[0, 0])  # the only modulus and the only travel


def level_checks(
    press: PressMotion = PRESS, E: float = 1.0, springs: Sequence[float] = SPRINGS
) -> tuple[ReferenceCheck, ...]:
    """Return the check of the force ratio P of level flat tips by law (3) of the paper; E in MPa, springs in N/mm.

    By law (3), each spring is in series with the stiffness K_m of the fruit. The force is the travel divided by the
    sum of their compliances, so P does not depend on the travel.
    """
    compliance = contact_compliance(BLOCK, TIPS)
    F, _ = forces(State(scene=Scene(fruit=BLOCK, tips=TIPS, press=press), E=E, springs=springs), compliance)
    K_m = E * compliance.K_m_over_E()
    series_compliances = [1.0 / K + 1.0 / K_m for K in springs]  # low and high spring [mm/N]
    law = Reference(values=(series_compliances[0] / series_compliances[1],), errors=(), source="paper's law (3)")
    return make_checks(("P",), (F[1] / F[0],), (ROUNDING,), law)


def press_checks(
    fruit: Fruit = BLOCK, press: PressMotion = PRESS, E: float = 1.0, springs: Sequence[float] = SPRINGS
) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces [N] against another solver for unilateral contact; E in MPa, springs in N/mm.

    Raises InputError if the press does not touch the fruit.
    """
    state = State(scene=Scene(fruit=fruit, tips=TIPS, press=press), E=E, springs=springs)
    compliance = contact_compliance(fruit, TIPS)
    F, error = forces(state, compliance)
    if F.max() == 0.0:
        msg = (
            f"press.travel_mm = {press.travel_mm:g} mm: no tip touches, so P is undefined. The travel must reach the "
            "middle of a cell."
        )
        raise InputError(msg)
    return _check_touching_tips(F, error, try_reference(partial(_extrapolate_forces, state, compliance)))


def direct_press_checks(press: PressMotion, truth: Reference, fruit: Fruit = BLOCK) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces [N] in presses of the paper's block at 2 MPa against known forces."""
    state = State(scene=Scene(fruit=fruit, tips=TIPS, press=press), E=2.0, springs=SPRINGS)
    return _check_touching_tips(*forces(state, contact_compliance(BLOCK, TIPS)), truth)


def _check_touching_tips(F: Floats, error: float, reference: Reference) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces F (tips,) [N] on the tips that touch, in the product or in the reference.

    If a tip touches in neither, its force has no relative error. `error` [1] is the relative error bar of all forces.
    """
    checks = make_checks(("F_l", "F_h"), F, (error,) * len(F), reference)
    round_off = ROUNDING * float(F.max())
    return tuple(check for check in checks if check.value > 0.0 or (check.reference or 0.0) > round_off)


def _extrapolate_forces(state: State, compliance: FruitCompliance) -> Reference:
    """Return the forces [N] of the other solver on two grids, extrapolated to cells of size 0.

    The error is the change that the extrapolation makes to the finer grid's forces.
    """
    cells = CELLS if state.scene.press.roll_deg == 0.0 else CELLS_ROLLED
    coarse, fine = (independent_forces(state, compliance, count) for count in cells)
    step = (fine - coarse) / ((cells[1] / cells[0]) ** ORDER - 1.0)
    source = f"least squares over forces on {cells[1]} cells a side"
    return Reference(values=tuple((fine + step).tolist()), errors=tuple(np.abs(step).tolist()), source=source)


def independent_forces(state: State, compliance: FruitCompliance, count: int) -> Floats:
    """Return the force on each tip [N] by another solver, with `count` cells along each side of a tip.

    Only the influence coefficients of the cells are shared with the product. The compliance of the springs acts equally
    on all cells of a tip, and so does a correction. For flat tips, the correction is the difference between the fruit
    and the cells in a level press. For other tips, the correction is the effect of the fruit's shape.
    """
    scene = state.scene
    cells, interference = _cells_and_interference(scene, count)
    tips = cells.tips  # incidence matrix (cells, tips)
    tip_compliance = state.E * spring_compliance(*state.springs)  # times E [1/mm]
    if scene.tips.tip_shape.has_flat_face:
        on_face = np.isfinite(interference)
        level_stiffness = tips[on_face].T @ np.linalg.solve(cells.compliance[np.ix_(on_face, on_face)], tips[on_face])
        tip_compliance = tip_compliance + compliance.S - np.linalg.inv(level_stiffness)
    else:
        tip_compliance = tip_compliance + compliance.shape_change
    overlaps = interference > 0.0  # other cells cannot touch
    if not overlaps.any():
        return np.zeros(len(tip_compliance))
    system = cells.compliance[np.ix_(overlaps, overlaps)] + tips[overlaps] @ tip_compliance @ tips[overlaps].T
    F: Floats = state.E * (tips[overlaps].T @ solve_complementarity(system, interference[overlaps]))
    return F


def _cells_and_interference(scene: Scene, count: int) -> tuple[ContactCells, Floats]:
    """Return the cells under the tips, and the interference of each cell with the undeformed fruit (cells,) [mm].

    The interference is the overlap of tip and fruit. It is minus infinity for a cell outside the face of its tip.
    """
    footprints = tuple(Footprint(x, y, scene.tips.side_mm) for x, y in scene.centres)
    cells = contact_cells(scene.fruit.equivalent_block, footprints, graded_edges(count, GRADING))
    if scene.press.roll_deg == 0.0:  # the contact is symmetric about y = 0
        cells = half_cells(cells)
    gap = scene.fruit_gap(*cells.points.T) + tip_gap(scene.tips.tip_shape, *cells.local.T) - scene.first_touch_mm
    travel = scene.press.travel_mm + (cells.points - cells.centres.mean(axis=0)) @ scene.tilt_tangents
    return cells, np.asarray(travel - gap)


def solve_complementarity(system: Floats, interference: Floats) -> Floats:
    """Return the forces f >= 0 that minimise the energy f A f / 2 - b f, with A = `system` and b = `interference`.

    With the Cholesky factor L of A, they are the nonnegative least-squares solution of L^T f = L^-1 b. See C. L.
    Lawson, R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.
    """
    lower = cholesky(system, lower=True)
    scale = float(interference.max())  # divides the right-hand side, so that it is of the order of 1
    right_side = solve_triangular(lower, interference / scale, lower=True)
    f, _ = nnls(lower.T, right_side, maxiter=100 * len(right_side))
    return np.asarray(scale * f)

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
GRADING = 2.0
ORDER = 1.5  # order of convergence of cells with constant pressure at the edge of a flat tip
BLOCK, TIPS, PRESS = Fruit(), Tips(), PressMotion()
SPRINGS = (0.9057, 20.831)  # [N/mm]


@dataclass(frozen=True, kw_only=True)
class State:
    """A scene with the modulus of its flesh [MPa] and the stiffnesses of its springs [N/mm]."""

    scene: Scene
    E: float
    springs: Sequence[float]


def forces(state: State, compliance: FruitCompliance) -> tuple[Floats, float]:
    """Return the product's force on each tip [N], and its relative error bar [1]."""
    C, travel = spring_compliance(*state.springs), state.scene.press.travel_mm
    response = scene_response(state.scene, compliance, C, [state.E], [travel])
    return response.F[0, 0], float(response.F_error[0, 0])


def level_checks(
    press: PressMotion = PRESS, E: float = 1.0, springs: Sequence[float] = SPRINGS
) -> tuple[ReferenceCheck, ...]:
    """Return the check of the force ratio P of level flat tips by law (3) of the paper; E in MPa, springs in N/mm."""
    compliance = contact_compliance(BLOCK, TIPS)
    F, _ = forces(State(scene=Scene(fruit=BLOCK, tips=TIPS, press=press), E=E, springs=springs), compliance)
    K_m = E * compliance.K_m_over_E()
    compliances = [1.0 / K + 1.0 / K_m for K in springs]
    law = Reference(values=(compliances[0] / compliances[1],), errors=(), source="paper's law (3)")
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
        msg = f"off the fruit, P is null: the travel of {press.travel_mm:g} mm must reach the middle of a cell"
        raise InputError(msg)
    return _check_touching_tips(F, error, try_reference(partial(_extrapolate_forces, state, compliance)))


def direct_press_checks(press: PressMotion, truth: Reference, fruit: Fruit = BLOCK) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces [N] in presses of the paper's block at 2 MPa against known forces."""
    state = State(scene=Scene(fruit=fruit, tips=TIPS, press=press), E=2.0, springs=SPRINGS)
    return _check_touching_tips(*forces(state, contact_compliance(BLOCK, TIPS)), truth)


def _check_touching_tips(F: Floats, error: float, reference: Reference) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces [N] on the tips that touch, in the product or in the reference."""
    every, round_off = make_checks(("F_l", "F_h"), F, (error,) * len(F), reference), ROUNDING * float(F.max())
    return tuple(check for check in every if check.value > 0.0 or (check.reference or 0.0) > round_off)


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

    Only the influence coefficients of the cells are shared with the product. For flat tips, a correction is added to
    the compliance. It is the difference between the fruit and the cells in a level press, for rigid tips.
    """
    scene = state.scene
    cells, interference = _cells_and_interference(scene, count)
    tips = cells.tips
    rigid = state.E * spring_compliance(*state.springs)
    if not scene.tips.tip_shape.has_flat_face:
        rigid = rigid + compliance.shape_change
    else:
        faces = np.isfinite(interference)
        level = tips[faces].T @ np.linalg.solve(cells.compliance[np.ix_(faces, faces)], tips[faces])
        rigid = rigid + compliance.S - np.linalg.inv(level)
    near = interference > 0.0  # other cells cannot touch
    if not near.any():
        return np.zeros(len(rigid))
    system = cells.compliance[np.ix_(near, near)] + tips[near] @ rigid @ tips[near].T
    pressed: Floats = state.E * (tips[near].T @ solve_complementarity(system, interference[near]))
    return pressed


def _cells_and_interference(scene: Scene, count: int) -> tuple[ContactCells, Floats]:
    """Return the cells under the tips, and the interference of each cell with the undeformed fruit (cells,) [mm].

    The interference is the overlap of tip and fruit. It is minus infinity for a cell outside the face of its tip.
    """
    footprints = tuple(Footprint(x, y, scene.tips.side_mm) for x, y in scene.centres)
    cells = contact_cells(scene.fruit.equivalent_block, footprints, graded_edges(count, GRADING))
    cells = half_cells(cells) if scene.press.roll_deg == 0.0 else cells
    gap = scene.fruit_gap(*cells.points.T) + tip_gap(scene.tips.tip_shape, *cells.local.T) - scene.first_touch_mm
    travel = scene.press.travel_mm + (cells.points - cells.centres.mean(axis=0)) @ scene.turn
    return cells, np.asarray(travel - gap)


def solve_complementarity(system: Floats, interference: Floats) -> Floats:
    """Return the forces f >= 0 that minimise the energy f A f / 2 - b f, with A = `system` and b = `interference`.

    With the Cholesky factor L of A, they are the non-negative least-squares solution of L^T f = L^-1 b. C. L. Lawson,
    R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23.
    """
    lower, scale = cholesky(system, lower=True), float(interference.max())
    right = solve_triangular(lower, interference / scale, lower=True)
    return np.asarray(scale * nnls(lower.T, right, maxiter=100 * len(right))[0])

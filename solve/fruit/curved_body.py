"""What the shape of a curved fruit changes in its compliance, against the block of its plan and thickness.

One mesh of the block, and the same mesh bent into the fruit, answer the same loads: the error that both have in common
cancels. The loads are vertical and smooth, a normal distribution about each tip as seen from above, so that few
elements resolve them. What the shape does to the sharper load of a rigid tip beyond that is the doing of slope and
curvature under the tip, in closed form (`cad/theory/sloped_skin.py`).
Flat tips are guided and sink along the vertical. Domes press and sink along the normal where they touch: their loads
and answers are taken along the normals of the skin.
The pressure under the rigid tip may be that on the block, for the change is stationary in it. E = 1 throughout.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from skfem import CellBasis, ElementHex2, MeshHex2

from cad.design.fruit import Fruit
from cad.quantity import validation_error
from cad.theory.sloped_skin import log_coefficient, slope_factor, stretch_factor
from mesh.cells import cell_slopes, determinant
from solve.arrays import Floats
from solve.elasticity import stiffness_matrix, vector_basis
from solve.error_estimate import SolveInfo
from solve.fruit.body_lines import BodySteps, body_lines
from solve.fruit.box import Lines, box_mesh
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_shape import CurvedShape, Vector
from solve.fruit.footprints import Footprint, level_parities, mirror_images
from solve.fruit.remainder import VOLUME_ORDER, Parity, mirror_dofs
from solve.fruit.smooth_load import SmoothLoad, least_deviation, line_shares, smooth_loads
from solve.fruit.split import largest_errors, relative_changes
from solve.linear import SolveError, factorised

STEPS = BodySteps()
COARSER = 0.7  # share of the elements along each line of the mesh whose answer gives the error
# Third order at 0.7 of the elements leaves 0.52 of the step between both meshes. The floor is for steps that vanish by
# accident, and for what slope and curvature do beyond their first order, which grows with (side / radius)^2.
SAFETY, FLOOR, SECOND_ORDER = 0.75, 1.5e-4, 0.05
REACH = 3.0  # deviations from its centre at which a load is over
# The mean of ln r under a rigid tip less that under the normal distribution with the same mean of 1 / r:
# 0.054 for a circle (exact), 0.064 for a square (boundary elements).
LOG_OFFSET = 0.06
STEEPEST = math.tan(math.radians(30.0))
LEAST_RADIUS = 4.0  # sides
THICKEST = 1.9  # radii: beyond, a whole fruit stands on so small a base that it rocks on its rim
OUTERMOST = 0.68  # of the cap of a whole fruit: beyond, its mesh folds
NEARER = "move the tips to the apex, or take a thicker fruit"


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """What the shape adds to the compliance of the block, times E [1/mm], shape (tips, tips), and the dofs.

    `step` is the change from a coarser mesh, `bound` how far the closed form may be off, both as the change.
    """

    change: Floats
    step: Floats
    bound: Floats
    dofs: int


def curved_compliance(
    block: FruitCompliance, fruit: Fruit, footprints: Sequence[Footprint], along_normals: bool = False
) -> FruitCompliance:
    """Return the compliance [1/mm] of a curved fruit, given that of its equivalent block under the same footprints.

    `along_normals` says that the tips press along the normals of the skin, as domes do. Raises InputError for a fruit
    that is too steep under a tip, too small or too thick, SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    check_curved(fruit, footprints)
    found = shape_change(fruit, footprints, STEPS, along_normals)
    S = block.S + found.change
    errors = SAFETY * relative_changes(found.step, S) + relative_changes(found.bound, S)
    pair, own = largest_errors(errors, len(S))
    info = SolveInfo(
        method=f"{block.info.method}, bent to the shape of the fruit",
        dofs=max(block.info.dofs, found.dofs),
        seconds=block.info.seconds + time.perf_counter() - start,
        status=_status(block, fruit, found, pair),
    )
    return replace(
        block,
        S=S,
        error_pair=block.error_pair + pair,
        error_own=block.error_own + own,
        info=info,
        shape_change=found.change,
    )


def _status(block: FruitCompliance, fruit: Fruit, found: ShapeChange, error: float) -> str:
    added = 100.0 * (block.K_m_over_E() / replace(block, S=block.S + found.change).K_m_over_E() - 1.0)
    size = f"{fruit.length_mm:.4g} x {fruit.width_mm:.4g} x {fruit.depth_mm:.4g} mm"
    return (
        f"a block of {size} ({block.info.status}), to which the shape of the {fruit.shape} adds {added:+.2f} % of "
        f"s11 - s12, known to {100.0 * error:.2g} %, by bending a mesh of {found.dofs} dofs"
    )


def shape_change(
    fruit: Fruit, footprints: Sequence[Footprint], steps: BodySteps = STEPS, along_normals: bool = False
) -> ShapeChange:
    """Return what a curved fruit adds to the compliance [1/mm] of its equivalent block under some footprints.

    Raises SolveError when a solve is not exact.
    """
    loads = smooth_loads(fruit, footprints)
    fine, dofs = curvature_correction(fruit, footprints, loads, steps, along_normals)
    coarse, _ = curvature_correction(
        fruit, footprints, loads, replace(steps, share=COARSER * steps.share), along_normals
    )
    sharper, bound = _sharper(fruit, footprints, loads, along_normals)
    return ShapeChange(fine + sharper, fine - coarse, bound, dofs)


def check_curved(fruit: Fruit, footprints: Sequence[Footprint]) -> None:
    """Raise InputError where the change by the shape is not known to its stated accuracy."""
    radius, side = fruit.radius_mm or math.inf, max(footprint.side for footprint in footprints)
    least = LEAST_RADIUS * side
    for name, value in (("fruit.radius_mm", radius), ("fruit.radius_across_mm", fruit.radius_across_mm or radius)):
        if value < least:
            bound = f"at least {LEAST_RADIUS:g} sides of a tip = {least:g} mm"
            raise validation_error(name, value, "mm", bound, "take smaller tips")
    if fruit.whole and fruit.depth_mm > THICKEST * radius:
        bound = f"at most {THICKEST:g} fruit.radius_mm = {THICKEST * radius:g} mm for a whole fruit"
        raise validation_error(fruit.depth_key, fruit.depth_mm, "mm", bound, "let it stand on a wider base")
    shape = CurvedShape(fruit, core_of(smooth_loads(fruit, footprints)))
    for footprint in footprints:
        if not shape.slope(footprint.x, footprint.y) <= STEEPEST:
            bound = f"where the skin falls by at most {math.degrees(math.atan(STEEPEST)):.0f} deg"
            raise validation_error("centre of a tip, x", footprint.x, "mm", bound, NEARER)
    if fruit.whole:
        _check_cap(shape)


def _check_cap(shape: CurvedShape) -> None:
    for axis, core, cap in zip(("x", "y"), shape.core, shape.cap, strict=True):
        if core > OUTERMOST * cap:
            bound, name = f"at most {OUTERMOST * cap:.3g} mm on this whole fruit", f"reach of the tips along {axis}"
            raise validation_error(name, core, "mm", bound, NEARER)


def core_of(loads: Sequence[SmoothLoad]) -> tuple[float, float]:
    """Return half of the plan [mm] along x and y that holds all loads."""
    x = max(abs(load.x) + REACH * load.deviation for load in loads)
    y = max(abs(load.y) + REACH * load.deviation for load in loads)
    return x, y


def _sharper(
    fruit: Fruit, footprints: Sequence[Footprint], loads: Sequence[SmoothLoad], along_normals: bool
) -> tuple[Floats, Floats]:
    """Return what the shape changes more under rigid tips than under smooth loads [1/mm], and how far that may be off.

    Both have shape (tips, tips); the action of one tip on another does not depend on how sharp it is.
    """
    pairs = zip(footprints, loads, strict=True)
    each = [_sharper_tip(fruit, one, load, along_normals) for one, load in pairs]
    return np.diag([change for change, _ in each]), np.diag([bound for _, bound in each])


def _sharper_tip(fruit: Fruit, tip: Footprint, load: SmoothLoad, along_normals: bool) -> tuple[float, float]:
    shape = CurvedShape(fruit, (0.0, 0.0))
    slope = shape.slope(tip.x, tip.y)
    curvature = shape.mean_curvature(tip.x, tip.y)
    least = least_deviation(tip)
    level = 0.5 * (1.0 - fruit.poisson**2) / math.sqrt(math.pi) / least  # compliance of the half-space
    share = least / load.deviation
    sloped = level * (1.0 - share) * (slope_factor(fruit.poisson, slope) - 1.0)
    if along_normals:
        # the contact of a dome is round along the skin, not as seen from above
        sloped, slope = level * share * (1.0 - stretch_factor(slope)), 0.0
    logarithm = -math.log(share) - LOG_OFFSET
    bound = level * (FLOOR + SECOND_ORDER * (tip.side * curvature) ** 2)
    return sloped + log_coefficient(fruit.poisson, slope) * curvature * logarithm, bound


def curvature_correction(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    steps: BodySteps,
    along_normals: bool = False,
) -> tuple[Floats, int]:
    """Return the change [1/mm] under smooth loads from a mesh of the block to the same mesh bent, and its dofs.

    Raises SolveError when a solve is not exact, or when the bent mesh folds.
    """
    shape = CurvedShape(fruit, core_of(loads))
    at_x, at_y = mirror_images(footprints)
    lines = body_lines(shape, loads, (bool(at_x), bool(at_y)), steps)
    box = box_mesh(lines)
    flat = MeshHex2.from_mesh(box).with_boundaries(box.boundaries)
    bent = replace(flat, doflocs=shape.bent(flat.doflocs))
    block, body = (vector_basis(mesh, ElementHex2(), VOLUME_ORDER) for mesh in (flat, bent))
    _check_folds(body)
    parities = level_parities(footprints)
    forces = [_nodal_forces(block, lines, loads, parity) for parity in parities]
    before = _compliance(block, fruit.poisson, parities, forces)
    if along_normals:
        normals = [shape.normal(load.x, load.y) for load in loads]
        forces = [_nodal_forces(block, lines, loads, parity, normals) for parity in parities]
    return _compliance(body, fruit.poisson, parities, forces) - before, int(block.N)


def _compliance(basis: CellBasis, poisson: float, parities: Sequence[Parity], forces: Sequence[Floats]) -> Floats:
    """Return the answer to the forces of each parity, added up to that of single loads [1/mm], shape (loads, loads)."""
    stiffness = stiffness_matrix(basis, 1.0, poisson, b_bar=True)
    clamped = basis.get_dofs("base").all()
    parts = []
    for parity, force in zip(parities, forces, strict=True):
        factor = factorised(stiffness, np.union1d(clamped, mirror_dofs(basis, parity)))
        parts.append(force.T @ factor.solve(force) / 2.0 ** np.abs(parity).sum())
    return np.asarray(sum(parts))


def _check_folds(basis: CellBasis) -> None:
    volumes = determinant(cell_slopes(basis.mesh, basis.quadrature[0]))
    least = float((volumes / np.median(volumes)).min())
    if not least > 0.0:
        msg = f"curved fruit: volume of a bent element = {least:.1g} of the median: must be above 0; take a finer mesh"
        raise SolveError(msg)


def _nodal_forces(
    basis: CellBasis, lines: Lines, loads: Sequence[SmoothLoad], parity: Parity, normals: Sequence[Vector] = ()
) -> Floats:
    """Return the forces of each load with its mirror images on the nodes of the box [1], shape (dofs, loads).

    Loads press down, or against the outward normals, whose part across a mirror plane changes sign with the image.
    """
    forces = np.zeros((basis.N, len(loads)))
    for component in range(3) if normals else (2,):
        top = basis.get_dofs("top").all(f"u^{component + 1}")
        for number, load in enumerate(loads):
            shares = np.full(len(top), -normals[number][component] if normals else 1.0)
            for axis, place in enumerate((load.x, load.y)):
                sign = -parity[axis] if axis == component else parity[axis]
                nodes, share = line_shares(lines[axis], place, load.deviation, sign)
                shares *= share[np.abs(basis.doflocs[axis, top, None] - nodes).argmin(axis=1)]
            forces[top, number] = shares
    return forces

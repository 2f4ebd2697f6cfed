"""The change in compliance due to the shape of a curved fruit, relative to the block of the same plan and thickness.

A mesh of the block and the same mesh bent into the fruit are solved under the same loads, so that common errors cancel.
The loads are smooth: each tip is replaced by a normal distribution in plan, which few elements resolve. A rigid tip has
a sharper load. The additional effect of slope and curvature under it has a closed form
(`sensor/theory/sloped_skin.py`). The pressure under a rigid tip on the block can be used, because the change is
stationary with respect to the pressure.

Flat tips are guided, and move vertically. Domes press and move along the normal at their contact, so their loads and
displacements are along the normals of the skin. E = 1 throughout.
"""

import functools
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.quantity import validation_error
from sensor.theory.sloped_skin import log_coefficient, slope_factor, stretch_factor
from solve.elasticity import stiffness_matrix
from solve.error_estimate import SolveInfo
from solve.fruit.bent_block import bent_block, enclosing_core
from solve.fruit.body_lines import BodySteps
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_shape import CurvedShape, Plan
from solve.fruit.footprints import Footprint
from solve.fruit.remainder import Parity
from solve.fruit.smooth_load import SmoothLoad, least_deviation, smooth_loads
from solve.fruit.split import LARGEST_ERROR, Errors, largest_errors, relative_changes
from solve.linear import factorise

STEPS = BodySteps()
COARSER = 0.7  # elements per axis in the coarser mesh of the error estimate, as a fraction of the finer mesh
ROUGH_STEPS = replace(STEPS, fraction=COARSER)
# Ratio of the error bar to the difference between the two meshes. With third-order convergence, and 0.7 times as many
# elements per side in the coarser mesh, the error of the finer mesh is 0.52 times the difference.
SAFETY = 0.75
FLOOR = 1.5e-4  # smallest relative error bar, because a small difference may be accidental
SECOND_ORDER = 0.05  # relative error due to second-order effects, divided by (side * curvature)^2
# Mean of ln r over the load of a rigid tip, minus its mean over the normal distribution with the same mean of 1 / r. It
# is 0.054 for a circle (exact) and 0.064 for a square (boundary elements).
LOG_OFFSET = 0.06
STEEPEST = math.tan(math.radians(30.0))  # largest slope of the skin under a tip
LEAST_RADIUS = 4.0  # smallest radius of the fruit [sides of a tip]
THICKEST = 1.9  # largest thickness of a whole fruit [radii]; a thicker fruit would rock on the rim of its small base
# Largest half size of the rectangle around the tips, divided by the half size of the cap of a whole fruit. Beyond this
# limit, elements of the mesh are folded.
OUTERMOST = 0.68
NEARER_HINT = "move the tips towards the apex, or use a thicker fruit"


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """The change in the block's compliance due to the shape of the fruit, times E [1/mm].

    All arrays have shape (tips, tips). `mesh_difference` is the difference between the change and its value on a
    coarser mesh, and `closed_form_error` bounds the error of the closed form. `dofs` is the number of degrees of
    freedom of the mesh.
    """

    change: Floats
    mesh_difference: Floats
    closed_form_error: Floats
    dofs: int


def curved_compliance(
    block: FruitCompliance,
    fruit: Fruit,
    footprints: Sequence[Footprint],
    along_normals: bool = False,
    tolerance: float = LARGEST_ERROR,
) -> FruitCompliance:
    """Return the compliance [1/mm] of a curved fruit, given the compliance `block` of its equivalent block.

    `footprints` are the footprints of the tips. With `along_normals`, the tips press along the normals of the skin, as
    domes do. The error of the change due to the shape is within the relative `tolerance` [1] if one of the meshes
    achieves this. Raises InputError for a fruit that is too steep under a tip, too small or too thick. Raises
    SolveError if a solve does not converge.
    """
    start = time.perf_counter()
    check_curved(fruit, footprints)
    shape, errors = _solve_coarsest_change(block, fruit, footprints, along_normals, tolerance)
    S = block.S + shape.change
    info = SolveInfo(
        method=f"{block.info.method}, bent to the shape of the fruit",
        dofs=max(block.info.dofs, shape.dofs),
        seconds=block.info.seconds + time.perf_counter() - start,
        status=_curved_status(block, fruit, shape, S, errors.pair),
    )
    return replace(
        block,
        S=S,
        difference_error=block.difference_error + errors.pair,
        s11_error=block.s11_error + errors.own,
        info=info,
        shape_change=shape.change,
    )


def _solve_coarsest_change(
    block: FruitCompliance, fruit: Fruit, footprints: Sequence[Footprint], along_normals: bool, tolerance: float
) -> tuple[ShapeChange, Errors]:
    """Return the change due to the shape, from the coarsest sufficient mesh, and the relative errors [1] due to it.

    The errors are relative to the compliance of the curved fruit. If the compliance `block` is rough or the `tolerance`
    [1] is above 1e-3, a coarser mesh is tried first, which takes a tenth of the time. The coarser mesh is sufficient if
    its errors are within the tolerance, or if `block` is rough. Otherwise the normal mesh is used, whatever its errors
    are. Raises SolveError if a solve does not converge.
    """
    may_be_rough = block.rough or tolerance > LARGEST_ERROR
    for steps in (ROUGH_STEPS, STEPS) if may_be_rough else (STEPS,):
        shape = shape_change(fruit, footprints, steps, along_normals)
        S = block.S + shape.change
        mesh_errors = SAFETY * relative_changes(shape.mesh_difference, S)
        errors = largest_errors(mesh_errors + relative_changes(shape.closed_form_error, S), len(S))
        if block.rough or max(errors) <= tolerance:
            break
    return shape, errors


def _curved_status(block: FruitCompliance, fruit: Fruit, shape: ShapeChange, S: Floats, error: float) -> str:
    """Return a status text for the report, with the change of s11 - s12 due to the shape and its relative error [1].

    S (tips, tips) [1/mm] is the compliance of the curved fruit, and `block` the compliance of its equivalent block.
    """
    # K_m / E is 1 / (s11 - s12), so this is the relative change of s11 - s12.
    change_percent = 100.0 * (block.K_m_over_E() / replace(block, S=S).K_m_over_E() - 1.0)
    return (
        f"a block of {fruit.length_mm:.4g} x {fruit.width_mm:.4g} x {fruit.depth_mm:.4g} mm ({block.info.status}), "
        f"whose s11 - s12 changes by {change_percent:+.2f} % in the shape of the {fruit.shape}, with an error of "
        f"{100.0 * error:.2g} %, by bending a mesh of {shape.dofs} dofs"
    )


def shape_change(
    fruit: Fruit, footprints: Sequence[Footprint], steps: BodySteps = STEPS, along_normals: bool = False
) -> ShapeChange:
    """Return the change in compliance under footprints from the equivalent block of a curved fruit to the fruit itself.

    The change under smooth loads is solved on two meshes, and `steps` determines the finer one. A closed form converts
    it to the change under rigid tips. With `along_normals`, the tips press along the normals of the skin, as domes do.
    Raises SolveError if a solve does not converge.
    """
    # Under domes, the loads are inclined, and their effect on a neighbour depends on their width. They therefore have
    # the smallest width, which is the width of the contact.
    loads = smooth_loads(fruit, footprints, largest_ratio=1.0) if along_normals else smooth_loads(fruit, footprints)
    fine_change, dofs = curvature_correction(fruit, footprints, loads, steps, along_normals)
    coarser_steps = replace(steps, fraction=COARSER * steps.fraction)
    coarse_change, _ = curvature_correction(fruit, footprints, loads, coarser_steps, along_normals)

    # Only the compliance of a tip under its own load depends on how the load is distributed.
    rigid_tip_changes = np.zeros(len(loads))
    rigid_tip_bounds = np.zeros(len(loads))
    for i, (footprint, load) in enumerate(zip(footprints, loads, strict=True)):
        rigid_tip_changes[i], rigid_tip_bounds[i] = _sharpness_correction(fruit, footprint, load, along_normals)
    return ShapeChange(
        change=fine_change + np.diag(rigid_tip_changes),
        mesh_difference=fine_change - coarse_change,
        closed_form_error=np.diag(rigid_tip_bounds),
        dofs=dofs,
    )


def check_curved(fruit: Fruit, footprints: Sequence[Footprint]) -> None:
    """Raise InputError if the fruit is outside the domain in which `shape_change` has its stated accuracy.

    In this domain, the radii are at least four sides of a tip, and the skin under a tip slopes by at most 30 deg. A
    whole fruit is at most 1.9 radii thick, and the tips are close enough to the apex that no element is folded.
    """
    radius = fruit.radius_mm or math.inf
    radius_across = fruit.radius_across_mm or radius
    smallest_radius = LEAST_RADIUS * max(footprint.side for footprint in footprints)
    for name, value in (("fruit.radius_mm", radius), ("fruit.radius_across_mm", radius_across)):
        if value < smallest_radius:
            bound = f"at least {LEAST_RADIUS:g} sides of a tip = {smallest_radius:g} mm"
            raise validation_error(name, value, "mm", bound, "use smaller tips")
    if fruit.is_whole and fruit.depth_mm > THICKEST * radius:
        bound = f"at most {THICKEST:g} fruit.radius_mm = {THICKEST * radius:g} mm for a whole fruit"
        raise validation_error(fruit.depth_key, fruit.depth_mm, "mm", bound, "use a thinner fruit with a wider base")
    _check_tips(fruit, footprints)


def _check_tips(fruit: Fruit, footprints: Sequence[Footprint]) -> None:
    """Raise InputError if the skin is too steep under a tip, or if a tip is too far from the apex of a whole fruit."""
    shape = CurvedShape(fruit, enclosing_core(smooth_loads(fruit, footprints)))
    for footprint in footprints:
        if not shape.slope(footprint.x, footprint.y) <= STEEPEST:
            bound = f"where the skin slopes by at most {math.degrees(math.atan(STEEPEST)):.0f} deg"
            raise validation_error("centre of a tip, x", footprint.x, "mm", bound, NEARER_HINT)
    if fruit.is_whole:
        # Half sizes along x and y of the rectangle around the tips, and of the cap around the apex.
        for axis, core, cap in zip("xy", shape.core, shape.cap, strict=True):
            if core > OUTERMOST * cap:
                name = f"reach of the tips along {axis}"
                bound = f"at most {OUTERMOST * cap:.3g} mm on this whole fruit"
                raise validation_error(name, core, "mm", bound, NEARER_HINT)


def _sharpness_correction(
    fruit: Fruit, footprint: Footprint, load: SmoothLoad, along_normals: bool
) -> tuple[float, float]:
    """Return the change in compliance under a rigid tip minus the change under its smooth load, and its error bound.

    Both results are multiplied by E [1/mm]. The change is from a flat to a curved fruit. With `along_normals`, the tip
    is a dome that presses along the normal of the skin. Slope and curvature under the tip act separately
    (`sensor/theory/sloped_skin.py`).
    """
    shape = CurvedShape(fruit, Plan(0.0, 0.0))  # the size of the core does not affect slope and curvature
    slope = shape.slope(footprint.x, footprint.y)
    curvature = shape.mean_curvature(footprint.x, footprint.y)
    # A normal distribution with this standard deviation has the compliance R of the rigid tip on a half-space.
    deviation = least_deviation(footprint)
    rigid_compliance = 0.5 * (1.0 - fruit.poisson**2) / math.sqrt(math.pi) / deviation
    ratio = deviation / load.deviation  # S / R, because the compliance is inversely proportional to the deviation
    slope_term = _slope_term(fruit.poisson, slope, rigid_compliance, ratio, along_normals)
    # Curvature acts through the mean of ln(distance) over a load, which differs between the tip and the smooth load.
    log_difference = -math.log(ratio) - LOG_OFFSET
    slope_to_load = 0.0 if along_normals else slope  # between the load and the normal of the skin
    curvature_term = log_coefficient(fruit.poisson, slope_to_load) * curvature * log_difference
    bound = rigid_compliance * (FLOOR + SECOND_ORDER * (footprint.side * curvature) ** 2)
    return slope_term + curvature_term, bound


def _slope_term(poisson: float, slope: float, R: float, ratio: float, along_normals: bool) -> float:
    """Return the effect of a `slope` [1] on the compliance under a rigid tip, minus its effect under the smooth load.

    The result is multiplied by E [1/mm]. Let R [1/mm] be the half-space compliance of the rigid tip, and S = `ratio` R
    the half-space compliance of its smooth load. A slope changes R and S as follows:

        vertical tips   R f and S f, so the difference is (R - S) (f - 1) with f = slope_factor
        domes           R and S g, so the difference is S (1 - g) with g = stretch_factor

    The contact of a dome is circular on the skin, so R does not change. Its smooth load is circular in plan, so S
    changes. With `along_normals`, the tip is a dome.
    """
    if along_normals:
        S = R * ratio
        return S * (1.0 - stretch_factor(slope))
    rigid_minus_smooth = R * (1.0 - ratio)
    return rigid_minus_smooth * (slope_factor(poisson, slope) - 1.0)


def curvature_correction(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    steps: BodySteps,
    along_normals: bool = False,
) -> tuple[Floats, int]:
    """Return the change in compliance under smooth loads when the mesh of the block is bent into the fruit.

    The change (loads, loads) [1/mm] is multiplied by E, and the second result is the number of dofs. The `loads`
    replace the footprints, and `steps` determines how fine the mesh is. With `along_normals`, the loads press along the
    normals of the skin of the fruit. Raises SolveError if a solve does not converge, or if an element of the bent mesh
    is folded.
    """
    body = bent_block(fruit, footprints, loads, steps, along_normals)
    block_matrix = stiffness_matrix(body.flat, 1.0, fruit.poisson, b_bar=True)
    fruit_matrix = stiffness_matrix(body.bent, 1.0, fruit.poisson, b_bar=True)
    upwards = [(0.0, 0.0, -1.0) for _ in loads]  # normals of the block, with z down

    def solve_parity(parity: Parity) -> Floats:
        """Return the part of the change that the loads of one parity cause, (loads, loads) [1/mm]."""
        fixed = body.fixed_dofs(parity)
        factor = factorise(block_matrix, fixed)
        block_compliance = _solve_compliance(body.forces(parity, upwards), factor.solve)
        # The matrix of the fruit is close to the matrix of the block, whose factor serves as preconditioner.
        solve_fruit = functools.partial(factor.solve_near, fruit_matrix)
        fruit_compliance = _solve_compliance(body.forces(parity, body.normals), solve_fruit)
        # A single load is the mean of its even and odd parts, hence a factor of one half for each mirror plane.
        return np.asarray((fruit_compliance - block_compliance) / 2.0 ** np.abs(parity).sum())

    # Factorisations release Python's global interpreter lock, so the parities can be solved in parallel.
    with ThreadPoolExecutor(len(body.parities)) as threads:
        changes = list(threads.map(solve_parity, body.parities))
    return np.asarray(np.sum(changes, axis=0)), int(body.flat.N)


def _solve_compliance(forces: Floats, solve: Callable[[Floats], Floats]) -> Floats:
    """Return the compliance F.K^-1 F (loads, loads) for loads F (dofs, loads).

    The function `solve` multiplies its argument (dofs, n) by K^-1. On a mesh that ends at mirror planes, loads often
    differ only in sign. Such loads are solved only once, and the signs are restored in the result.
    """
    representative, relative_sign = _match_loads(forces)
    distinct_loads = sorted(set(representative))
    distinct_compliance = forces[:, distinct_loads].T @ solve(forces[:, distinct_loads])
    rows = [distinct_loads.index(load) for load in representative]  # row of each load in `distinct_compliance`
    return np.asarray(np.outer(relative_sign, relative_sign) * distinct_compliance[np.ix_(rows, rows)])


def _match_loads(forces: Floats) -> tuple[list[int], Floats]:
    """Return the index of the first load that is equal or opposite to each load, and its sign relative to that load.

    `forces` (dofs, loads) are the nodal forces. A relative sign, of shape (loads,), is 1 for an equal load and -1 for
    an opposite one.
    """
    # Each load is multiplied by the sign of its first nonzero component, which makes opposite loads equal.
    first_nonzero = np.argmax(forces != 0.0, axis=0)[None]
    signs = np.sign(np.take_along_axis(forces, first_nonzero, axis=0))[0]
    # Loads are compared by their bytes. Adding 0 removes the sign of zeros, which would make equal loads differ.
    normalised_loads = [column.tobytes() for column in (forces * signs + 0.0).T]
    first_equal = [normalised_loads.index(column) for column in normalised_loads]
    return first_equal, signs * signs[first_equal]

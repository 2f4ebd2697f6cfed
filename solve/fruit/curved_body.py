"""The change of compliance by the shape of a curved fruit, against the block of its plan and thickness.

One mesh of the block and the same mesh bent into the fruit are solved under the same loads, so that common errors
cancel. The loads are vertical and smooth: a normal distribution about each tip, seen from above, which few elements
resolve. A rigid tip has a sharper load. The further effect of slope and curvature under it has a closed form
(`sensor/theory/sloped_skin.py`). Flat tips are guided and move along the vertical. Domes press and move along the
normal at their contact, so their loads and displacements are taken along the normals of the skin. The pressure under
the rigid tip may be taken from the block, because the change is stationary in it. E = 1 throughout.
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
from solve.fruit.bent_block import bent_block, core_of
from solve.fruit.body_lines import BodySteps
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_shape import CurvedShape, Plan
from solve.fruit.footprints import Footprint
from solve.fruit.remainder import Parity
from solve.fruit.smooth_load import SmoothLoad, least_deviation, smooth_loads
from solve.fruit.split import LARGEST_ERROR, largest_errors, relative_changes
from solve.linear import factorise

STEPS = BodySteps()
COARSER = 0.7  # fraction of the elements along each line, for the mesh that gives the error
ROUGH_STEPS = replace(STEPS, fraction=COARSER)
# At third order and 0.7 of the elements, the error is 0.52 of the step between both meshes. FLOOR covers steps that are
# small by accident, and SECOND_ORDER the effects of slope and curvature beyond the first order.
SAFETY = 0.75  # error bar over the step between both meshes
FLOOR = 1.5e-4  # relative error
SECOND_ORDER = 0.05  # relative error over (side times curvature)^2
# Difference of the mean of ln r between a rigid tip and the normal distribution with the same mean of 1 / r. It is
# 0.054 for a circle (exact) and 0.064 for a square (boundary elements).
LOG_OFFSET = 0.06
STEEPEST = math.tan(math.radians(30.0))  # largest slope of the skin under a tip
LEAST_RADIUS = 4.0  # least radius of the fruit [sides]
THICKEST = 1.9  # largest thickness of a whole fruit [radii]; beyond, its base is so small that it rocks on its rim
OUTERMOST = 0.68  # largest reach of the tips over the cap of a whole fruit; beyond, its mesh folds
NEARER = "move the tips to the apex, or take a thicker fruit"


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """The change of the block's compliance by the shape, times E [1/mm], shape (tips, tips), and the dofs.

    `step` is the difference from a coarser mesh, `bound` the error bound of the closed form, in the shape of the
    change.
    """

    change: Floats
    step: Floats
    bound: Floats
    dofs: int


def curved_compliance(
    block: FruitCompliance,
    fruit: Fruit,
    footprints: Sequence[Footprint],
    along_normals: bool = False,
    tolerance: float = LARGEST_ERROR,
) -> FruitCompliance:
    """Return the compliance [1/mm] of a curved fruit, given the compliance `block` of its equivalent block.

    With `along_normals`, the tips press along the normals of the skin, as domes do. For a relative tolerance [1] above
    1e-3, coarser meshes are used if their error allows it, in a tenth of the time. Raises InputError for a fruit that
    is too steep under a tip, too small or too thick, and SolveError if a solve does not converge.
    """
    start = time.perf_counter()
    check_curved(fruit, footprints)
    for steps in (ROUGH_STEPS, STEPS) if block.rough or tolerance > LARGEST_ERROR else (STEPS,):
        shape = shape_change(fruit, footprints, steps, along_normals)
        S = block.S + shape.change
        errors = largest_errors(SAFETY * relative_changes(shape.step, S) + relative_changes(shape.bound, S), len(S))
        if block.rough or max(errors) <= tolerance:
            break
    added_percent = 100.0 * (block.K_m_over_E() / replace(block, S=S).K_m_over_E() - 1.0)
    status = (
        f"a block of {fruit.length_mm:.4g} x {fruit.width_mm:.4g} x {fruit.depth_mm:.4g} mm ({block.info.status}), "
        f"whose s11 - s12 changes by {added_percent:+.2f} % in the shape of the {fruit.shape}, with an error of "
        f"{100.0 * errors.pair:.2g} %, by bending a mesh of {shape.dofs} dofs"
    )
    info = SolveInfo(
        method=f"{block.info.method}, bent to the shape of the fruit",
        dofs=max(block.info.dofs, shape.dofs),
        seconds=block.info.seconds + time.perf_counter() - start,
        status=status,
    )
    return replace(
        block,
        S=S,
        error_pair=block.error_pair + errors.pair,
        error_own=block.error_own + errors.own,
        info=info,
        shape_change=shape.change,
    )


def shape_change(
    fruit: Fruit, footprints: Sequence[Footprint], steps: BodySteps = STEPS, along_normals: bool = False
) -> ShapeChange:
    """Return the change of compliance from the equivalent block of a curved fruit to the fruit, under footprints.

    Two meshes give the change under smooth loads, and a closed form the further change under rigid tips. Raises
    SolveError if a solve does not converge.
    """
    # The effect on a neighbour that leans depends on the width of a load, so under domes it has the width of the
    # contact.
    loads = smooth_loads(fruit, footprints, 1.0) if along_normals else smooth_loads(fruit, footprints)
    fine, dofs = curvature_correction(fruit, footprints, loads, steps, along_normals)
    coarser = replace(steps, fraction=COARSER * steps.fraction)
    coarse, _ = curvature_correction(fruit, footprints, loads, coarser, along_normals)

    # Only the effect of a tip on itself depends on the distribution of its load.
    sharper = np.zeros(len(loads))
    bound = np.zeros(len(loads))
    for i, (footprint, load) in enumerate(zip(footprints, loads, strict=True)):
        sharper[i], bound[i] = _sharpness_correction(fruit, footprint, load, along_normals)
    return ShapeChange(fine + np.diag(sharper), fine - coarse, np.diag(bound), dofs)


def check_curved(fruit: Fruit, footprints: Sequence[Footprint]) -> None:
    """Raise InputError if the change by the shape would not have its stated accuracy."""
    radius = fruit.radius_mm or math.inf
    least = LEAST_RADIUS * max(footprint.side for footprint in footprints)
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
        for axis, core, cap in zip("xy", shape.core, shape.cap, strict=True):
            if core > OUTERMOST * cap:
                name = f"reach of the tips along {axis}"
                bound = f"at most {OUTERMOST * cap:.3g} mm on this whole fruit"
                raise validation_error(name, core, "mm", bound, NEARER)


def _sharpness_correction(fruit: Fruit, tip: Footprint, load: SmoothLoad, along_normals: bool) -> tuple[float, float]:
    """Return the change by the shape under a rigid tip less the change under its smooth load, and its bound [1/mm].

    Slope and curvature under the tip act separately (`sensor/theory/sloped_skin.py`). With R the compliance of the
    rigid tip and S of its smooth load on a half-space, a slope changes them as follows:

        vertical tips   R f and S f, so the difference is (R - S) (f - 1), f = slope_factor
        domes           R and S g, so the difference is S (1 - g), g = stretch_factor

    The contact of a dome is round along the skin, so R is unchanged; its smooth load is round seen from above, so S is
    not.
    """
    shape = CurvedShape(fruit, Plan(0.0, 0.0))
    slope = shape.slope(tip.x, tip.y)
    curvature = shape.mean_curvature(tip.x, tip.y)
    least = least_deviation(tip)
    rigid = 0.5 * (1.0 - fruit.poisson**2) / math.sqrt(math.pi) / least  # compliance R on a half-space
    ratio = least / load.deviation  # S / R
    if along_normals:
        smooth = rigid * ratio
        by_slope = smooth * (1.0 - stretch_factor(slope))
        slope = 0.0  # load and displacement are along the normal, to which the skin is level
    else:
        rigid_less_smooth = rigid * (1.0 - ratio)
        by_slope = rigid_less_smooth * (slope_factor(fruit.poisson, slope) - 1.0)
    # Curvature acts through the mean of ln(distance) over a load; this is its difference between the two loads.
    log_difference = -math.log(ratio) - LOG_OFFSET
    by_curvature = log_coefficient(fruit.poisson, slope) * curvature * log_difference
    bound = rigid * (FLOOR + SECOND_ORDER * (tip.side * curvature) ** 2)
    return by_slope + by_curvature, bound


def curvature_correction(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    steps: BodySteps,
    along_normals: bool = False,
) -> tuple[Floats, int]:
    """Return the change [1/mm] under smooth loads from a mesh of the block to the same mesh bent, and its dofs.

    The change is (loads, loads). Raises SolveError if a solve does not converge, or if the bent mesh folds.
    """
    body = bent_block(fruit, footprints, loads, steps, along_normals)
    of_block = stiffness_matrix(body.flat, 1.0, fruit.poisson, b_bar=True)
    of_fruit = stiffness_matrix(body.bent, 1.0, fruit.poisson, b_bar=True)
    upwards = [(0.0, 0.0, -1.0) for _ in loads]

    def of_parity(parity: Parity) -> Floats:
        fixed = body.fixed_dofs(parity)
        factor = factorise(of_block, fixed)
        before = _compliance(body.forces(parity, upwards), factor.solve)
        after = _compliance(body.forces(parity, body.normals), functools.partial(factor.solve_near, of_fruit))
        # A single load is the mean of its parities, hence the half for each mirror plane.
        return np.asarray((after - before) / 2.0 ** np.abs(parity).sum())

    # Factorisations release Python's lock, so the parities are solved in parallel.
    with ThreadPoolExecutor(len(body.parities)) as threads:
        changes = list(threads.map(of_parity, body.parities))
    return np.asarray(np.sum(changes, axis=0)), int(body.flat.N)


def _compliance(forces: Floats, solve: Callable[[Floats], Floats]) -> Floats:
    """Return F.K^-1 F of loads F (dofs, loads), shape (loads, loads); `solve` applies the inverse of K.

    On a mesh that ends at mirror planes, loads often differ only in sign. Such loads are solved once.
    """
    signs = np.sign(np.take_along_axis(forces, np.argmax(forces != 0.0, axis=0)[None], axis=0))[0]
    turned = [column.tobytes() for column in (forces * signs + 0.0).T]  # adding 0 removes the sign of zeros
    which = [turned.index(column) for column in turned]  # the first equal load
    first = sorted(set(which))
    energy = forces[:, first].T @ solve(forces[:, first])
    place = [first.index(load) for load in which]
    same_way = signs * signs[which]
    return np.asarray(np.outer(same_way, same_way) * energy[np.ix_(place, place)])

"""The compliance of a block of fruit under rigid flat tips by singularity subtraction, the method `split`.

The pressure under a tip is singular at its edges. The half-space solution contains this singularity in closed form
(`solve/fruit/footprints.py`). Only the smooth remainder, which the finite size of the block adds, is therefore solved
on a mesh (`solve/fruit/remainder.py`). The condition that each tip stays level determines its pressure.
"""

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from sensor.quantity import validation_error
from solve.error_estimate import SolveInfo
from solve.fruit.box import Grading, Lines, block_lines
from solve.fruit.compliance import FruitCompliance, MeshCompliance
from solve.fruit.footprints import (
    Footprint,
    NodeCounts,
    closest_spacing,
    half_space_compliance,
    level_compliance,
    level_parities,
    mirror_images,
    node_remainder,
    nodes_between,
    nodes_within,
)
from solve.halfspace.punch import circle_punch, square_punch
from solve.linear import SolveError

# Diameter of the circle that represents a dome, divided by the side of its face. It is a typical contact diameter.
DOME_CIRCLE = 0.5
# Mesh gradings of the levels, from coarse to fine.
LEVELS = (
    Grading(0.7, (0.7, 0.21, 0.09)),
    Grading(0.5, (0.7, 0.21, 0.063, 0.027)),
    Grading(0.35, (0.7, 0.21, 0.063, 0.0189, 0.0081)),
)
LARGEST_ERROR = 1e-3  # largest relative error that is accepted if no mesh meets the tolerance
MOST_DOFS = 60_000  # maximum number of dofs of the finer levels; this many need 4 GiB of memory
# Ratio of the error bar to the difference between two meshes. The finer mesh has 4/3 as many elements along each axis.
# With fourth-order convergence, its error is 0.46 times the difference; the error bar is about twice as large. See
# tests/reference/fits/test_fruit.py.
SAFETY = 0.9
# Smallest difference between two meshes that is assumed on the coarsest level, because a smaller one may be accidental.
# It is a fraction of the mean of two remainders: the remainder of the value itself, and the largest of all remainders.
LEAST_STEP = 1e-3
ORDER = 4  # order of convergence of the remainder in the grading step
# The only mesh for loose tolerances. ROUGH_ERROR is the largest ratio of error to remainder in 280 random scenes; in 40
# of them, the ratio is at most 0.006.
ROUGH = Grading(1.0, (0.7, 0.3))
ROUGH_ERROR = 0.01
NODE_ERROR = 1e-5  # relative error due to the finite numbers of nodes per footprint: twice 5e-6
# Spacing [sides] below which more nodes do not reduce the error. Boundary elements differ by 7e-4 at a spacing of 1.05.
CLOSE_SPACING = 1.1
CLOSE_SPACING_ERROR = 1.5e-3  # relative error added below this spacing
# Height [sides] below which the remainder is as large as the half-space part, and needs smaller steps.
LOW_HEIGHT = 3.0
ROUNDING_FACTOR = 1.0 + 1e-9  # factor that admits scenes exactly on a bound, despite rounding
MIN_EDGE_GAP = 1.0  # smallest gap from the edge of a tip to a side face [sides]
MIN_SPACING = 1.05  # smallest spacing of tips [sides]
POISSON_RANGE = (-0.5, 0.4999)  # smallest and largest Poisson's ratio


class Errors(NamedTuple):
    """The largest relative errors over all tips [1]: `pair` for (s_ii + s_jj) / 2 - s_ij, and `own` for s_ii."""

    pair: float
    own: float


def contact_footprints(fruit: Fruit, tips: Tips) -> tuple[Footprint, ...]:
    """Return the flat footprints [mm] that represent the tips: the face of a flat tip, or a circle for a dome.

    The circle is centred where the dome touches the fruit. On a curved fruit, this point is closer to the apex than the
    axis of the dome. The size of the circle hardly matters. Its own half-space compliance has a closed form, which
    `solve/contact/domes/fruit_under_domes.py` subtracts again.
    """
    if tips.dome_radius_mm is None:
        punch = circle_punch if tips.tip_shape.is_round else square_punch
        return tuple(Footprint(x, y, tips.side_mm, punch) for x, y in tips.places_mm)
    # A sphere of radius r touches a surface of radius R at R / (R + r) times the offset of its axis from the apex. On a
    # block, R is infinite and the fraction is 1.
    radius_along, radius_across = fruit.radii_mm
    fraction_along = 1.0 / (1.0 + tips.dome_radius_mm / radius_along)
    fraction_across = 1.0 / (1.0 + tips.dome_radius_mm / radius_across)
    side = DOME_CIRCLE * tips.side_mm
    footprints = []
    for dome_axis in tips.places_mm:
        u, v = fruit.to_principal(*dome_axis)  # the axis of the dome, in the principal directions of the fruit
        x, y = fruit.from_principal(fraction_along * u, fraction_across * v)
        footprints.append(Footprint(x, y, side, circle_punch))
    return tuple(footprints)


def split_compliance(fruit: Fruit, tips: Tips, tolerance: float = LARGEST_ERROR) -> FruitCompliance:
    """Return the compliance [1/mm] of a fruit's equivalent block under the tips.

    The solve uses the coarsest mesh whose error in s11 - s12 is within the relative `tolerance` [1]. If no mesh is
    accurate enough, it uses the best one, provided that its error is at most 1e-3. Raises SolveError if a solve does
    not converge. Raises InputError if the error is larger, if the tolerance is not above 0, or if the scene is outside
    the domain of the method (`check_domain`).
    """
    start = time.perf_counter()
    if not tolerance > 0.0:
        raise validation_error("tolerance", tolerance, "", "above 0", "the default is 0.001")
    block = fruit.equivalent_block
    footprints = contact_footprints(fruit, tips)
    check_domain(block, footprints)

    mesh_compliance, errors = _solve_coarsest(block, footprints, tolerance)
    close_error = CLOSE_SPACING_ERROR if closest_spacing(footprints) < CLOSE_SPACING else 0.0
    return FruitCompliance(
        tips=tips.names,
        S=mesh_compliance.S,
        difference_error=errors.pair + close_error,
        s11_error=errors.own + close_error,
        info=SolveInfo(
            method="split",
            dofs=mesh_compliance.dofs,
            seconds=time.perf_counter() - start,
            status=_status(mesh_compliance.dofs, errors.pair, tolerance, close_error),
        ),
    )


def _solve_coarsest(block: Fruit, footprints: Sequence[Footprint], tolerance: float) -> tuple[MeshCompliance, Errors]:
    """Return the compliance from the coarsest mesh that meets the relative tolerance [1], and its relative errors.

    If no mesh meets the tolerance, the best one is used. Raises InputError if its error is larger than both the
    tolerance and 1e-3, and SolveError if a solve does not converge.
    """
    limit = max(tolerance, LARGEST_ERROR)
    candidates = _solve_levels(block, footprints, tolerance, limit)

    def rank(candidate: tuple[MeshCompliance, Errors]) -> tuple[bool, float]:
        """Return the key for `min`: meshes within the limit come first, and then those with a smaller pair error."""
        _, errors = candidate
        return max(errors) > limit, errors.pair

    mesh_compliance, errors = min(candidates, key=rank)
    if max(errors) > limit:
        hint = "use a thicker fruit, or move the tips farther from its edges and from each other"
        rounded_error = float(f"{max(errors):.3g}")  # for the message
        raise validation_error("relative error of the contact", rounded_error, "1", f"at most {limit:g}", hint)
    return mesh_compliance, errors


def _solve_levels(
    block: Fruit, footprints: Sequence[Footprint], tolerance: float, limit: float
) -> list[tuple[MeshCompliance, Errors]]:
    """Return the compliance and its relative errors [1] on successively finer meshes, until one is accurate enough.

    A mesh is accurate enough if its error of s11 - s12 is at most `tolerance` [1], and no error is above `limit` [1].
    The rough mesh is tried only for loose tolerances. Finer meshes that would need too much memory are skipped. Raises
    SolveError if a solve on any other mesh than the rough one does not converge.
    """
    levels = (ROUGH, *LEVELS) if tolerance > LARGEST_ERROR else LEVELS
    candidates = []
    for grading in levels:
        if grading in LEVELS[1:] and mesh_dofs(block, footprints, grading) > MOST_DOFS:
            continue
        try:
            mesh_compliance = footprint_compliance(block, footprints, grading)
        except SolveError:
            if grading != ROUGH:
                raise
            continue  # the rough mesh is too coarse for a symmetric compliance
        errors = level_errors(block, footprints, grading, mesh_compliance.S)
        candidates.append((mesh_compliance, errors))
        if errors.pair <= tolerance and max(errors) <= limit:
            break
    return candidates


def _status(dofs: int, error: float, tolerance: float, close_error: float) -> str:
    """Return a sentence for the report about the accuracy of a solve. Errors and tolerance are relative [1]."""
    status = f"half-space in closed form, smooth remainder on {dofs} dofs: "
    if error <= tolerance:
        status += f"the coarsest mesh, whose error, {100.0 * error:.2g} %, meets {100.0 * tolerance:.3g} %"
    else:
        status += f"the best mesh, whose error, {100.0 * error:.2g} %, misses {100.0 * tolerance:.3g} %"
    if close_error > 0.0:
        status += f"; tips closer than {CLOSE_SPACING:g} sides add {100.0 * close_error:g} %"
    return status


def footprint_compliance(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading) -> MeshCompliance:
    """Return the compliance [1/mm] of a block under level footprints, on the mesh of one grading.

    Only one side of each mirror plane is meshed. Raises SolveError if a solve does not converge.
    """
    counts = NodeCounts(between=nodes_between(footprints), within=nodes_within(fruit, footprints))
    lines = _grid_lines(fruit, footprints, grading)
    remainder, dofs = node_remainder(fruit, footprints, lines, level_parities(footprints), counts)
    S = level_compliance(footprints, fruit.poisson, remainder, counts.between)
    for images in mirror_images(footprints):
        if images:
            S = 0.5 * (S + S[np.ix_(images, images)])  # makes entries of mirror images equal to the last bit
    return MeshCompliance(S, dofs)


def mesh_dofs(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading) -> int:
    """Return the number of dofs of the remainder on the mesh of a grading, without generating the mesh."""
    return 3 * math.prod(2 * len(line) - 1 for line in _grid_lines(fruit, footprints, grading))


def _grid_lines(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading) -> Lines:
    """Return the grid lines [mm] of the mesh of a grading, which start at the mirror planes of the footprints."""
    per_side = nodes_within(fruit, footprints)
    nodes = np.concatenate([footprint.nodes(per_side) for footprint in footprints])
    widest = max(footprint.side for footprint in footprints)
    # In a low block, the remainder is large relative to the compliance. Since the error is of fourth order in the step,
    # this factor reduces it in proportion to the height.
    step = grading.step * min(1.0, fruit.height_mm / (LOW_HEIGHT * widest)) ** 0.25
    mirrored = [bool(images) for images in mirror_images(footprints)]
    return block_lines(fruit, nodes, mirrored, replace(grading, step=step))


def level_errors(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading, fine: Floats) -> Errors:
    """Return the estimated relative errors [1] of `fine`, the compliance [1/mm] on the mesh of a grading.

    The estimate is based on the difference from a coarser mesh, which is solved here. For the rough grading there is no
    coarser mesh, so its error is a fixed fraction of the remainder. Raises SolveError if the solve does not converge.
    """
    node_count = nodes_between(footprints)
    node_error = max(footprint.punch(node_count).error for footprint in footprints) + NODE_ERROR
    half_space = half_space_compliance(tuple(footprints), fruit.poisson)
    # All arrays of errors and differences hold one value per pair of tips, followed by one value per tip.
    relative_remainder = relative_changes(fine - half_space, fine)
    if grading == ROUGH:
        error = ROUGH_ERROR * float(relative_remainder.max()) + node_error
        return Errors(error, error)
    smallest_fraction = LEAST_STEP * (grading.step / LEVELS[0].step) ** ORDER  # scales with the step like the error
    smallest_difference = smallest_fraction * 0.5 * (relative_remainder + relative_remainder.max())
    coarse = footprint_compliance(fruit, footprints, grading.coarser()).S
    relative_difference = relative_changes(fine - coarse, fine)
    mesh_errors = SAFETY * np.maximum(relative_difference, smallest_difference)
    return largest_errors(mesh_errors + node_error, len(footprints))


def largest_errors(errors: Floats, tips: int) -> Errors:
    """Return the largest error over all pairs of tips, and the largest error over single tips [1].

    `errors` has one value per pair of tips, followed by one value for each of the `tips` tips. For a single tip, both
    results are its error.
    """
    own = float(errors[-tips:].max())
    pair = float(errors[:-tips].max(initial=0.0))
    return Errors(pair or own, own)


def relative_changes(change: Floats, S: Floats) -> Floats:
    """Return the relative changes [1] of s_ii + s_jj - 2 s_ij for each pair of tips, then of s_ii for each tip.

    `change` is the change in the compliance S. Both have the shape (tips, tips) and the same unit.
    """
    # The product load @ S @ load is s_ii for a unit force on tip i, and s_ii + s_jj - 2 s_ij for opposite unit forces
    # on the tips i and j.
    single_loads = list(np.eye(len(S)))
    opposite_loads = [a - b for a, b in itertools.combinations(single_loads, 2)]
    changes = []
    for load in (*opposite_loads, *single_loads):
        changes.append(abs((load @ change @ load) / (load @ S @ load)))
    return np.array(changes)


def check_domain(fruit: Fruit, footprints: Sequence[Footprint]) -> None:
    """Raise InputError if the scene is outside the domain in which `split` has its stated accuracy.

    In this domain, a tip is at most as wide as the block is high, and at least one side away from each side face. The
    spacing of the tips is at least 1.05 sides, and -0.5 <= nu <= 0.4999.
    """
    if fruit.shape != "block":
        raise validation_error("fruit.shape", fruit.shape, "", "block", "use the equivalent block of the fruit")
    low, high = POISSON_RANGE
    if not low <= fruit.poisson <= high:
        bound = f"at least {low:g} and at most {high:g} for the contact"
        hint = "Poisson's ratio of fruit flesh is 0.2 to 0.49"
        raise validation_error("fruit.poisson", fruit.poisson, "1", bound, hint)
    for footprint in footprints:
        _check_footprint(fruit, footprint)
    closest = closest_spacing(footprints)
    if closest * ROUNDING_FACTOR < MIN_SPACING:
        hint = "move the tips apart, or use smaller tips"
        rounded_spacing = float(f"{closest:.6g}")  # for the message
        raise validation_error("tips.spacing_mm / side_mm", rounded_spacing, "1", f"at least {MIN_SPACING:g}", hint)


def _check_footprint(fruit: Fruit, footprint: Footprint) -> None:
    """Raise InputError if a footprint is too wide for the height of the block, or too close to a side face."""
    side = footprint.side
    if side > fruit.height_mm * ROUNDING_FACTOR:
        bound = f"at most fruit.height_mm = {fruit.height_mm:g} mm"
        raise validation_error("tips.side_mm", side, "mm", bound, "use smaller tips or a taller fruit")
    gap = footprint.distance_to_edge(fruit) - 0.5 * side
    if gap * ROUNDING_FACTOR < MIN_EDGE_GAP * side:
        bound = f"at least one side of the tip, {MIN_EDGE_GAP * side:g} mm"
        hint = "move the tips inwards, or use smaller tips or a larger fruit"
        rounded_gap = float(f"{gap:.6g}")  # for the message
        raise validation_error("gap from tip to side face", rounded_gap, "mm", bound, hint)

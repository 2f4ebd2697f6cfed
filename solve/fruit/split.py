"""Compliance of a block of fruit under rigid flat tips by singularity subtraction, `split` for short.

The pressure under the tips is singular at their edges: the half-space carries it in closed form
(`solve/fruit/footprints.py`), and only the smooth remainder of the block is solved on a mesh
(`solve/fruit/remainder.py`). A tip keeps level and its pressure adapts.
"""

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.quantity import validation_error
from solve.arrays import Floats
from solve.error_estimate import SolveInfo
from solve.fruit.box import Grading, Lines, block_lines
from solve.fruit.compliance import TIPS, FruitCompliance, MeshCompliance
from solve.fruit.footprints import (
    Footprint,
    closest_spacing,
    level_compliance,
    level_parities,
    mirror_images,
    node_remainder,
    nodes_between,
    nodes_within,
)
from solve.halfspace.punch import circle_punch, square_punch
from solve.linear import SolveError

Errors = tuple[float, float]  # relative: of the mean of s_ii and s_jj less s_ij, and of s_ii; the largest over the tips

DOME_CIRCLE = 0.5  # of the face that carries a dome: the contact of a dome that uses its face well
LEVELS = (
    Grading(0.7, (0.7, 0.21, 0.09)),
    Grading(0.5, (0.7, 0.21, 0.063, 0.027)),
    Grading(0.35, (0.7, 0.21, 0.063, 0.0189, 0.0081)),
)
LARGEST_ERROR = 1e-3
MOST_DOFS = 60_000  # of a finer level: 4 GiB
# Fourth order at 3/4 of the steps leaves 0.46 of the step between both meshes: the bar is twice that.
# tests/fits/split_errors.py
SAFETY = 0.9
# A difference of two meshes may vanish by accident: at grading step 0.7 it counts as at least this share of the
# remainder in a value, averaged with the value where that share is largest.
LEAST_SHARE, ORDER = 1e-3, 4
# One mesh without a coarser partner, for loose tolerances: the largest error of 280 random scenes over the remainder,
# 0.006 over the 40 of tests/fits/split_errors.py.
ROUGH = Grading(1.0, (0.7, 0.3))
ROUGH_SHARE = 0.01
NODE_ERROR = 1e-5  # what the nodes of the footprints leave, twice 5e-6
# Under 1.1 sides more nodes no longer settle it: boundary elements differ by 7e-4 at 1.05 sides.
CLOSE, CLOSE_ERROR = 1.1, 1.5e-3
# Under this height [sides] the remainder is as large as the half-space part and asks for smaller steps.
LOW = 3.0
ROUNDING = 1.0 + 1e-9
EDGE_GAP = 1.5
SPACING = 1.05
POISSON = (-0.5, 0.4999)


class SplitDomainError(ValueError):
    """A scene that the split does not solve to its stated accuracy; the message says why and what to do instead."""


def tip_footprints(tips: Tips) -> tuple[Footprint, ...]:
    """Return the footprints of flat tips [mm]; raises SplitDomainError for tips that are not flat."""
    if not tips.tip_shape.has_flat_face:
        raise _refusal("tips.shape", tips.shape, "", "one with a flat face")
    punch = circle_punch if tips.tip_shape.is_round else square_punch
    return tuple(Footprint(x, y, tips.side_mm, punch) for x, y in tips.places_mm)


def contact_footprints(fruit: Fruit, tips: Tips) -> tuple[Footprint, ...]:
    """Return the flat footprints [mm] that stand for the tips: sharp faces, and for domes a circle where they touch.

    A level dome touches nearer to the apex of a curved fruit than its own centre stands. What the circle takes of the
    half-space is known in closed form and put back by `solve/contact/domes/body.py`, so its size hardly matters.
    """
    if tips.dome_radius_mm is None:
        return tip_footprints(tips.flat)
    along, across = (1.0 / (1.0 + tips.dome_radius_mm / radius) for radius in fruit.radii_mm)
    return tuple(Footprint(along * x, across * y, DOME_CIRCLE * tips.side_mm, circle_punch) for x, y in tips.places_mm)


def split_compliance(fruit: Fruit, tips: Tips, tolerance: float = LARGEST_ERROR) -> FruitCompliance:
    """Return the compliance [1/mm] of a block under flat tips on the coarsest mesh whose error meets a tolerance.

    As `block_compliance`, for the footprints of the tips.
    """
    return block_compliance(fruit, tip_footprints(tips), tolerance, tips.names)


def block_compliance(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    tolerance: float = LARGEST_ERROR,
    names: tuple[str, ...] = TIPS,
) -> FruitCompliance:
    """Return the compliance [1/mm] of a block under named footprints on the coarsest mesh that meets a tolerance.

    The tolerance is relative, of s11 - s12 [1]; where no mesh meets it, the best counts if its error is at most 1e-3.
    Raises InputError for a tolerance that is not above 0, SplitDomainError outside the domain (tip edge at least 1.5
    sides from each side face, side at most the height, spacing at least 1.05 sides, -0.5 <= nu <= 0.4999) or beyond
    both errors, SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    if not tolerance > 0.0:
        raise validation_error("tolerance", tolerance, "", "above 0", "0.001 is the default")
    check_domain(fruit, footprints)
    limit = max(tolerance, LARGEST_ERROR)
    solved, (pair, own) = _best_level(fruit, footprints, tolerance, limit)
    if max(pair, own) > limit:
        raise _refusal("relative error", max(pair, own), "", f"at most {limit:g}")
    close = CLOSE_ERROR if closest_spacing(footprints) < CLOSE else 0.0
    info = SolveInfo(
        method="split",
        dofs=solved.dofs,
        seconds=time.perf_counter() - start,
        status=_status(solved.dofs, pair, tolerance, close),
    )
    return FruitCompliance(tips=names, S=solved.S, error_pair=pair + close, error_own=own + close, info=info)


def _best_level(
    fruit: Fruit, footprints: Sequence[Footprint], tolerance: float, limit: float
) -> tuple[MeshCompliance, Errors]:
    """Return the compliance on the coarsest mesh whose errors meet the tolerance and the limit, or on the best one."""
    levels = []
    for grading in (ROUGH, *LEVELS) if tolerance > LARGEST_ERROR else LEVELS:
        if grading in LEVELS[1:] and mesh_dofs(fruit, footprints, grading) > MOST_DOFS:
            continue  # finer than fits in memory
        try:
            solved = footprint_compliance(fruit, footprints, grading)
        except SolveError:
            if grading != ROUGH:
                raise
            continue  # too coarse for reciprocal answers
        errors = level_errors(fruit, footprints, grading, solved.S)
        if errors[0] <= tolerance and max(errors) <= limit:
            return solved, errors
        levels.append((solved, errors))
    return min(levels, key=lambda level: (max(level[1]) > limit, level[1][0]))


def _status(dofs: int, error: float, tolerance: float, close: float) -> str:
    best, meets = ("coarsest", "meets") if error <= tolerance else ("best", "misses")
    choice = f"the {best} mesh, whose error, {100.0 * error:.2g} %, {meets} {100.0 * tolerance:.3g} %"
    added = f"; tips closer than {CLOSE:g} sides add {100.0 * close:g} %" if close else ""
    return f"half-space in closed form, smooth remainder on {dofs} dofs: {choice}{added}"


def footprint_compliance(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading) -> MeshCompliance:
    """Return the compliance [1/mm] of a block under level footprints on one mesh; mirror planes halve the mesh.

    Raises SolveError when a solve is not exact.
    """
    within, between = nodes_within(fruit, footprints), nodes_between(footprints)
    lines = _lines(fruit, footprints, grading)
    remainder, dofs = node_remainder(fruit, footprints, lines, level_parities(footprints), within, between)
    S = level_compliance(footprints, fruit.poisson, remainder, between)
    for images in mirror_images(footprints):
        S = 0.5 * (S + S[np.ix_(images, images)]) if images else S  # alike to the last bit
    return MeshCompliance(S, dofs)


def mesh_dofs(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading) -> int:
    """Return the dofs that the remainder has on the mesh of a grading, shape known without making it."""
    return 3 * math.prod(2 * len(line) - 1 for line in _lines(fruit, footprints, grading))


def _lines(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading) -> Lines:
    """Return the lines of the mesh [mm], from mirror planes where the footprints have them."""
    extent = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    places = np.concatenate([footprint.nodes(nodes_within(fruit, footprints)) for footprint in footprints])
    step = grading.step * min(1.0, fruit.height_mm / (LOW * max(footprint.side for footprint in footprints))) ** 0.25
    at_x, at_y = mirror_images(footprints)
    return block_lines(extent, places, (bool(at_x), bool(at_y)), replace(grading, step=step))


def level_errors(fruit: Fruit, footprints: Sequence[Footprint], grading: Grading, fine: Floats) -> Errors:
    """Return the relative errors [1] of `fine`, the compliance [1/mm] on the mesh of a grading, from a coarser mesh."""
    between = nodes_between(footprints)
    nodes = max(footprint.punch(between).error for footprint in footprints) + NODE_ERROR
    half_space = level_compliance(footprints, fruit.poisson, np.zeros(()), between)
    share = relative_changes(fine - half_space, fine)
    if grading == ROUGH:
        error = ROUGH_SHARE * float(share.max()) + nodes
        return error, error
    least = LEAST_SHARE * (grading.step / LEVELS[0].step) ** ORDER * 0.5 * (share + share.max())
    step = relative_changes(fine - footprint_compliance(fruit, footprints, grading.coarser()).S, fine)
    return largest_errors(SAFETY * np.maximum(step, least) + nodes, len(footprints))


def largest_errors(errors: Floats, tips: int) -> Errors:
    """Return the largest error of pairs, or of single tips where there is no pair, and the largest of single tips [1].

    `errors` are in the order of `relative_changes`.
    """
    own = float(errors[-tips:].max())
    return float(errors[:-tips].max(initial=0.0)) or own, own


def relative_changes(change: Floats, S: Floats) -> Floats:
    """Return what a change of S is of the mean of s_ii and s_jj less s_ij, for each pair, then of each s_ii [1].

    Both have shape (tips, tips) and one unit.
    """
    units = np.eye(len(S))
    pressed = [units[i] - units[j] for i, j in itertools.combinations(range(len(S)), 2)]
    return np.array([abs((load @ change @ load) / (load @ S @ load)) for load in (*pressed, *units)])


def check_domain(fruit: Fruit, footprints: Sequence[Footprint]) -> None:
    """Raise SplitDomainError when a scene lies outside what the split solves to its stated accuracy."""
    if fruit.shape != "block":
        raise _refusal("fruit.shape", fruit.shape, "", "block")
    if not POISSON[0] <= fruit.poisson <= POISSON[1]:
        raise _refusal("fruit.poisson", fruit.poisson, "", f"at least {POISSON[0]:g} and at most {POISSON[1]:g}")
    for footprint in footprints:
        side = footprint.side
        if side > fruit.height_mm * ROUNDING:
            raise _refusal("tips.side_mm", side, " mm", f"at most fruit.height_mm = {fruit.height_mm:g} mm")
        gap = footprint.room(fruit) - 0.5 * side
        if gap * ROUNDING < EDGE_GAP * side:
            raise _refusal(
                "gap from tip to side face", gap, " mm", f"at least {EDGE_GAP:g} sides = {EDGE_GAP * side:g} mm"
            )
    closest = closest_spacing(footprints)
    if closest * ROUNDING < SPACING:
        raise _refusal("tips.spacing_mm / side_mm", closest, "", f"at least {SPACING:g}")


def _refusal(name: str, value: float | str, unit: str, bound: str) -> SplitDomainError:
    shown = value if isinstance(value, str) else f"{value:.6g}"
    return SplitDomainError(f"{name} = {shown}{unit}: must be {bound} for the split; solve by direct finite elements")

"""Compliance of a block of fruit under rigid flat tips: half-space in closed form, the smooth remainder on a mesh.

Nodal forces F and nodal displacements U of a tip's footprint are tied by its punch table, F = Y U (`solve/punch.py`).
U is what the tip prescribes less what the other tips and the block's finite size add there: U = d - G F, with G the
half-space between the tips plus the remainder v everywhere. So (I + Y G) F = Y d holds the forces of all tips
at once, however close they are; a tip keeps level and its pressure adapts.
"""

import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from cad.design.parameters import Fruit, Tips
from cad.quantity import fault
from solve.fruit.box import Grading, block_lines, box_mesh
from solve.fruit.compliance import Compliance
from solve.fruit.remainder import Parity, remainder_compliance
from solve.halfspace.punch import Punch, circle_punch, square_punch
from solve.linear import SolveError

Floats = NDArray[np.float64]
Errors = tuple[float, float]

PUNCHES: dict[str, Callable[[int], Punch]] = {"cube": square_punch, "cylinder": circle_punch}
LEVELS = (
    Grading(0.7, (0.7, 0.21, 0.09)),
    Grading(0.5, (0.7, 0.21, 0.063, 0.027)),
    Grading(0.35, (0.7, 0.21, 0.063, 0.0189, 0.0081)),
)
LARGEST_ERROR = 1e-3
MOST_DOFS = 60_000  # of a finer level: 4 GiB
# Fourth order at 3/4 of the steps leaves 0.46 of the step between both meshes: the bar is twice that.
SAFETY = 0.9
# A step may vanish by accident: at grading step 0.7 it counts as at least this share of the remainder in a value, on
# average with the value where it is largest: what cancels in s11 - s12 leaves its errors there.
LEAST_SHARE, ORDER = 1e-3, 4
# One mesh without a coarser partner, for loose tolerances: the largest error of 280 random scenes over the remainder.
ROUGH = Grading(1.0, (0.7, 0.3))
ROUGH_SHARE = 0.01
# Nodes a side for the tips' action on each other, from this spacing [sides] up, and on the remainder, from this
# height and distance to a side face [sides] up: each keeps its error below 5e-6 of s11.
NODES_BETWEEN = ((4.0, 3), (2.0, 5), (1.2, 9), (1.1, 17), (0.0, 25))
NODES_WITHIN = ((2.5, 2), (1.5, 3), (0.0, 4))
NODE_ERROR = 1e-5
# Under 1.1 sides more nodes no longer settle it: boundary elements differ by 7e-4 at 1.05 sides.
CLOSE, CLOSE_ERROR = 1.1, 1.5e-3
# Under this height [sides] the remainder is as large as the half-space part and asks for smaller steps.
LOW = 3.0
RESIDUAL_LIMIT = 1e-10
ROUNDING = 1.0 + 1e-9
EDGE_GAP = 1.5
SPACING = 1.05
POISSON = (-0.5, 0.4999)


class SplitDomainError(ValueError):
    """A scene that the split does not solve to its stated accuracy; the message says why and what to do instead."""


@dataclass(frozen=True)
class Foot:
    """The footprint of one tip: its centre on the length axis and its side [mm], and the punch table of its shape."""

    x: float
    side: float
    punch: Callable[[int], Punch] = square_punch

    def nodes(self, per_side: int) -> Floats:
        """Return the places of the nodes on the top of the block [mm], shape (nodes, 2)."""
        places: Floats = self.side * self.punch(per_side).nodes + np.array([self.x, 0.0])
        return places


@dataclass(frozen=True)
class FeetCompliance:
    """Indentation of foot i per force on foot j, times E [1/mm], shape (feet, feet), and the dofs of its mesh."""

    S: Floats
    dofs: int


def split_compliance(fruit: Fruit, tips: Tips, tolerance: float = LARGEST_ERROR) -> Compliance:
    """Return the compliance of a block under two flat tips on the coarsest mesh whose error meets a tolerance.

    The tolerance is relative, of s11 - s12 [1]; where no mesh meets it, the best counts if its error is at most 1e-3.
    Raises InputError for a tolerance that is not above 0, SplitDomainError outside the domain (tip edge at least 1.5
    sides from each side face, side at most the height, spacing at least 1.05 sides, -0.5 <= nu <= 0.4999) or beyond
    both errors, SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    if not tolerance > 0.0:
        raise fault("tolerance", tolerance, "", "above 0", "0.001 is the default")
    if tips.shape not in PUNCHES:
        raise _refusal("tips.shape", tips.shape, "", f"one of {', '.join(PUNCHES)}")
    feet = [Foot(x, tips.side_mm, PUNCHES[tips.shape]) for x in tips.centres_mm]
    check_domain(fruit, feet)
    limit = max(tolerance, LARGEST_ERROR)
    found, errors = _chosen(_levels(fruit, feet, tolerance), (tolerance, limit))
    if max(errors) > limit:
        raise _refusal("relative error", max(errors), "", f"at most {limit:g}")
    S, status, close = found.S, _status(found, errors[0], tolerance), 0.0
    if _closest(feet) < CLOSE:
        status, close = f"{status}; tips closer than {CLOSE:g} sides add {100.0 * CLOSE_ERROR:g} %", CLOSE_ERROR
    return Compliance(
        S=((float(S[0, 0]), float(S[0, 1])), (float(S[1, 0]), float(S[1, 1]))),
        error_percent=100.0 * (errors[0] + close),
        s11_error_percent=100.0 * (errors[1] + close),
        method="split",
        dofs=found.dofs,
        seconds=time.perf_counter() - start,
        status=status,
    )


def _levels(fruit: Fruit, feet: Sequence[Foot], tolerance: float) -> Iterator[tuple[FeetCompliance, Errors]]:
    """Yield the compliance and its errors, from the coarsest mesh that may serve to the finest that fits in memory."""
    gradings = (ROUGH, *LEVELS) if tolerance > LARGEST_ERROR else LEVELS
    for grading in gradings:
        if grading in LEVELS[1:] and mesh_dofs(fruit, feet, grading) > MOST_DOFS:
            continue
        try:
            found = feet_compliance(fruit, feet, grading)
        except SolveError:
            if grading != ROUGH:
                raise
            continue  # too coarse for reciprocal answers
        yield found, level_errors(fruit, feet, grading, found.S)


def _chosen(
    levels: Iterator[tuple[FeetCompliance, Errors]], bounds: tuple[float, float]
) -> tuple[FeetCompliance, Errors]:
    """Return the first level with a paired error and a largest error within the bounds, or the best of all."""
    seen = []
    for found, errors in levels:
        seen.append((found, errors))
        if errors[0] <= bounds[0] and max(errors) <= bounds[1]:
            return found, errors
    return min(seen, key=lambda one: (max(one[1]) > bounds[1], one[1][0]))


def _status(found: FeetCompliance, error: float, tolerance: float) -> str:
    """Say what was solved and why on this mesh."""
    met, meets = ("coarsest", "meets") if error <= tolerance else ("best", "misses")
    choice = f"the {met} mesh, whose error, {100.0 * error:.2g} %, {meets} {100.0 * tolerance:.3g} %"
    return f"half-space in closed form, smooth remainder on {found.dofs} dofs: {choice}"


def feet_compliance(fruit: Fruit, feet: Sequence[Foot], grading: Grading) -> FeetCompliance:
    """Return the compliance of a block under level feet on its length axis, on one mesh.

    Two like feet at -x and x are solved on a quarter of the block, pressed with and against each other; any others
    on the half y >= 0. Raises SolveError when a solve is not exact.
    """
    pair = _is_pair(feet)
    solved = feet[1:] if pair else feet
    parities: tuple[Parity, ...] = ((1, 1), (-1, 1)) if pair else ((0, 1),)
    within, between = nodes_within(fruit, feet), nodes_between(feet)
    loads, spread = zip(*(_loads(foot, within, between) for foot in solved), strict=True)
    mesh = box_mesh(_lines(fruit, feet, grading))
    remainder = remainder_compliance(mesh, fruit.poisson, np.concatenate(loads), parities)
    spreading = block_diag(*spread)
    S = [
        level_compliance(solved, fruit.poisson, 2.0 * spreading.T @ answer @ spreading, (parity[0], between))
        for answer, parity in zip(remainder.compliances, parities, strict=True)
    ]
    if not pair:
        return FeetCompliance(S[0], remainder.dofs)
    own, cross = 0.5 * (S[0] + S[1])[0, 0], 0.5 * (S[0] - S[1])[0, 0]
    return FeetCompliance(np.array([[own, cross], [cross, own]]), remainder.dofs)


def mesh_dofs(fruit: Fruit, feet: Sequence[Foot], grading: Grading) -> int:
    """Return the dofs that the remainder has on the mesh of a grading, without making it."""
    return 3 * math.prod(2 * len(line) - 1 for line in _lines(fruit, feet, grading))


def _is_pair(feet: Sequence[Foot]) -> bool:
    return len(feet) == 2 and feet[0] == Foot(-feet[1].x, feet[1].side, feet[1].punch)  # noqa: PLR2004 - a pair


def _lines(fruit: Fruit, feet: Sequence[Foot], grading: Grading) -> tuple[Floats, Floats, Floats]:
    """Return the lines of the mesh [mm]: of the quarter under a pair of like feet at -x and x, else of the half."""
    extent = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    places = np.concatenate([foot.nodes(nodes_within(fruit, feet)) for foot in feet])
    step = grading.step * min(1.0, fruit.height_mm / (LOW * max(foot.side for foot in feet))) ** 0.25
    return block_lines(extent, places, (_is_pair(feet), True), replace(grading, step=step))


def _loads(foot: Foot, within: int, between: int) -> tuple[Floats, Floats]:
    """Return the places y >= 0 of the loads on the remainder, and the matrix that spreads nodal forces over them.

    A load stands for itself and its mirror image at y = 0: half of each nodal force goes to either.
    """
    half = within // 2
    fold = np.zeros((within - half, within))
    for j in range(within):
        fold[max(j, within - 1 - j) - half, j] = 0.5
    carried = foot.punch(within).interpolate(foot.punch(between).nodes).T
    places = foot.nodes(within).reshape(within, within, 2)[:, half:].reshape(-1, 2)
    return places, np.kron(np.eye(within), fold) @ carried


def level_compliance(feet: Sequence[Foot], poisson: float, G: Floats, how: tuple[int, int]) -> Floats:
    """Return the compliance of feet that stay level, given the remainder's answer G between all their nodes [1/mm].

    `how` is the sign of the like force on the mirror image of the one foot (0 without an image), and nodes a side.
    """
    mirror, between = how
    places = np.concatenate([foot.nodes(between) for foot in feet])
    owner = np.repeat(np.arange(len(feet)), between**2)
    offset = places[:, None] - places
    distance = np.where(owner[:, None] == owner, np.inf, np.hypot(offset[..., 0], offset[..., 1]))
    coupling = 1.0 / distance
    if mirror:
        coupling += mirror / np.hypot(places[:, None, 0] + places[:, 0], offset[..., 1])
    G = G + (1.0 - poisson**2) / np.pi * coupling
    Y = block_diag(*(foot.side * foot.punch(between).stiffness for foot in feet)) / (1.0 - poisson**2)
    level = (owner[:, None] == np.arange(len(feet))).astype(np.float64)
    system, right = np.eye(len(places)) + Y @ G, Y @ level
    forces = np.linalg.solve(system, right)
    residual = float(np.abs(system @ forces - right).max() / np.abs(right).max())
    if not residual <= RESIDUAL_LIMIT:
        msg = f"tip forces: relative residual {residual:.1e} must be at most {RESIDUAL_LIMIT:.0e}; check the scene"
        raise SolveError(msg)
    S = np.linalg.inv(level.T @ forces)
    return np.asarray(0.5 * (S + S.T))


def _closest(feet: Sequence[Foot]) -> float:
    """Return the smallest spacing over side; infinite for a single foot."""
    pairs = itertools.combinations(feet, 2)
    return min((abs(one.x - other.x) / max(one.side, other.side) for one, other in pairs), default=np.inf)


def nodes_between(feet: Sequence[Foot]) -> int:
    """Return the nodes a side that carry the tips' action on each other."""
    closest = _closest(feet)
    return next(nodes for spacing, nodes in NODES_BETWEEN if closest >= spacing)


def nodes_within(fruit: Fruit, feet: Sequence[Foot]) -> int:
    """Return the nodes a side that carry the tips' action on the remainder."""
    gaps = [min(0.5 * fruit.length_mm - abs(foot.x), 0.5 * fruit.width_mm) / foot.side for foot in feet]
    room = min(*gaps, *(fruit.height_mm / foot.side for foot in feet))
    return next(nodes for least, nodes in NODES_WITHIN if room >= least)


def level_errors(fruit: Fruit, feet: Sequence[Foot], grading: Grading, fine: Floats) -> Errors:
    """Return the relative errors of the mean of s11 and s22 less s12, and of s11 and s22 (the larger), on a mesh.

    `fine` is the compliance of two feet on the mesh of the grading [1/mm]; a coarser one is solved but for ROUGH.
    """
    between = nodes_between(feet)
    own = max(foot.punch(between).error for foot in feet) + NODE_ERROR
    size = len(feet) * between**2
    half_space = level_compliance(feet, fruit.poisson, np.zeros((size, size)), (0, between))
    share = _relative(fine - half_space, fine)
    if grading == ROUGH:
        error = ROUGH_SHARE * float(share.max()) + own
        return error, error
    least = LEAST_SHARE * (grading.step / LEVELS[0].step) ** ORDER * 0.5 * (share + share.max())
    step = _relative(fine - feet_compliance(fruit, feet, grading.coarser()).S, fine)
    errors = SAFETY * np.maximum(step, least) + own
    return float(errors[0]), float(errors[1:].max())


def _relative(change: Floats, S: Floats) -> Floats:
    """Return what a change of S is of the mean of s11 and s22 less s12, of s11 and of s22."""
    pressed = np.array([0.5, -0.5])
    paired = (pressed @ change @ pressed) / (pressed @ S @ pressed)
    return np.abs(np.array([paired, *(np.diag(change) / np.diag(S))], dtype=np.float64))


def check_domain(fruit: Fruit, feet: Sequence[Foot]) -> None:
    """Raise SplitDomainError when a scene lies outside what the split solves to its stated accuracy."""
    if fruit.shape != "block":
        raise _refusal("fruit.shape", fruit.shape, "", "block")
    if not POISSON[0] <= fruit.poisson <= POISSON[1]:
        raise _refusal("fruit.poisson", fruit.poisson, "", f"at least {POISSON[0]:g} and at most {POISSON[1]:g}")
    for foot in feet:
        if foot.side > fruit.height_mm * ROUNDING:
            raise _refusal("tips.side_mm", foot.side, " mm", f"at most fruit.height_mm = {fruit.height_mm:g} mm")
        gap = min(0.5 * fruit.length_mm - abs(foot.x), 0.5 * fruit.width_mm) - 0.5 * foot.side
        if gap * ROUNDING < EDGE_GAP * foot.side:
            bound = f"at least {EDGE_GAP:g} sides = {EDGE_GAP * foot.side:g} mm"
            raise _refusal("gap from tip to side face", gap, " mm", bound)
    if _closest(feet) * ROUNDING < SPACING:
        raise _refusal("tips.spacing_mm / side_mm", _closest(feet), "", f"at least {SPACING:g}")


def _refusal(name: str, value: float | str, unit: str, bound: str) -> SplitDomainError:
    shown = value if isinstance(value, str) else f"{value:.6g}"
    return SplitDomainError(f"{name} = {shown}{unit}: must be {bound} for the split; solve by direct finite elements")

"""Compliance of a block of fruit under rigid flat tips: half-space in closed form, the smooth remainder on a mesh.

Nodal forces F and nodal displacements U of a tip's footprint are tied by its punch table, F = Y U (`solve/punch.py`).
U is what the tip prescribes less what the other tips and the block's finite size add there: U = d - G F, with G the
half-space between the tips plus the remainder v everywhere. So (I + Y G) F = Y d holds the forces of all tips
at once, however close they are; a tip keeps level and its pressure adapts.
"""

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from cad.parameters import Fruit, Tips
from solve.box import Grading, block_lines, box_mesh
from solve.compliance import Compliance
from solve.linear import SolveError
from solve.punch import Punch, circle_punch, square_punch
from solve.remainder import Parity, remainder_compliance

Floats = NDArray[np.float64]

PUNCHES: dict[str, Callable[[int], Punch]] = {"cube": square_punch, "cylinder": circle_punch}
LEVELS = (
    Grading(0.7, (0.7, 0.21, 0.09)),
    Grading(0.5, (0.7, 0.21, 0.063, 0.027)),
    Grading(0.35, (0.7, 0.21, 0.063, 0.0189, 0.0081)),
)
LARGEST_ERROR = 1e-3
LEAST_ERROR = 6e-5  # on the coarsest grading: where both steps nearly vanished, 8e-5 was the true error of one in 40
# Over 36 random scenes the true error was 0.1 to 1.2 of the step from the coarser mesh.
SAFETY = 1.25
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


def split_compliance(fruit: Fruit, tips: Tips) -> Compliance:
    """Return the compliance of a block under two flat tips; finer meshes until the error is at most 1e-3.

    Raises SplitDomainError outside the domain (tip edge at least 1.5 sides from each side face, side at most the
    height, spacing at least 1.05 sides, -0.5 <= nu <= 0.4999), SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    if tips.shape not in PUNCHES:
        raise _refusal("tips.shape", tips.shape, "", f"one of {', '.join(PUNCHES)}")
    feet = [Foot(x, tips.side_mm, PUNCHES[tips.shape]) for x in tips.centres_mm]
    check_domain(fruit, feet)
    for grading in LEVELS:
        fine = feet_compliance(fruit, feet, grading)
        errors = _errors(feet_compliance(fruit, feet, grading.coarser()).S, fine.S, feet)
        if max(errors) <= LARGEST_ERROR:
            break
    if max(errors) > LARGEST_ERROR:
        raise _refusal("relative error", max(errors), "", f"at most {LARGEST_ERROR:g}")
    S, close = fine.S, CLOSE_ERROR if _closest(feet) < CLOSE else 0.0
    return Compliance(
        S=((float(S[0, 0]), float(S[0, 1])), (float(S[1, 0]), float(S[1, 1]))),
        error_percent=100.0 * (errors[0] + close),
        s11_error_percent=100.0 * (errors[1] + close),
        method="split",
        dofs=fine.dofs,
        seconds=time.perf_counter() - start,
        status=f"half-space in closed form, smooth remainder on {fine.dofs} dofs; error from a coarser mesh",
    )


def feet_compliance(fruit: Fruit, feet: Sequence[Foot], grading: Grading) -> FeetCompliance:
    """Return the compliance of a block under level feet on its length axis, on one mesh.

    Two like feet at -x and x are solved on a quarter of the block, pressed with and against each other; any others
    on the half y >= 0. Raises SolveError when a solve is not exact.
    """
    pair = len(feet) == 2 and feet[0] == Foot(-feet[1].x, feet[1].side, feet[1].punch)  # noqa: PLR2004 - a pair
    solved = feet[1:] if pair else feet
    parities: tuple[Parity, ...] = ((1, 1), (-1, 1)) if pair else ((0, 1),)
    within, between = nodes_within(fruit, feet), nodes_between(feet)
    loads, spread = zip(*(_loads(foot, within, between) for foot in solved), strict=True)
    extent = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    places = np.concatenate([foot.nodes(within) for foot in feet])
    step = grading.step * min(1.0, fruit.height_mm / (LOW * max(foot.side for foot in feet))) ** 0.25
    mesh = box_mesh(block_lines(extent, places, (pair, True), replace(grading, step=step)))
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


def _errors(coarse: Floats, fine: Floats, feet: Sequence[Foot]) -> tuple[float, float]:
    """Return the relative errors of the mean of s11 and s22 less s12, and of s11 and s22 (the larger)."""
    own = max(foot.punch(nodes_between(feet)).error for foot in feet) + NODE_ERROR
    change = fine - coarse
    pressed = np.array([0.5, -0.5])
    apart = abs(pressed @ change @ pressed) / (pressed @ fine @ pressed)
    alone = float(np.abs(np.diag(change) / np.diag(fine)).max())
    # Either step may be near zero by accident, both hardly ever are.
    error = max(LEAST_ERROR, float(SAFETY * max(apart, alone) + own))
    return error, error


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

"""Footprints of tips on a block of fruit, and their compliance from forces and displacements at nodes.

Nodal forces F and nodal displacements U of a footprint are related by its punch table, F = Y U
(`solve/halfspace/punch.py`). U is the prescribed displacement d of the tip, minus the displacement that the other tips
and the finite size of the block cause. So U = d - G F, where the matrix G is the sum of two parts. One is the
compliance of a half-space between different tips. The other is the remainder, which is the compliance that the finite
block adds, between all nodes. The linear system

    (I + Y G) F = Y d

then determines the forces of all tips at once, even if the tips are close together.
"""

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, lu_factor, lu_solve

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.fruit.box import Lines, box_mesh
from solve.fruit.remainder import Parity, remainder_compliance
from solve.halfspace.punch import Punch, square_punch
from solve.linear import SolveError

# Smallest spacing of tips [sides], and nodes per side for their interaction. The error is below 5e-6 times s11.
NODES_BETWEEN = ((4.0, 3), (2.0, 5), (1.2, 9), (1.1, 17), (0.0, 25))
# Smallest height and distance from a side face [sides], and nodes per side for the remainder, with as small an error.
NODES_WITHIN = ((2.5, 2), (1.5, 3), (0.0, 4))
RESIDUAL_LIMIT = 1e-10  # largest allowed relative residual of the forces
SAME_POINT = 9  # decimals to which coordinates [sides] are rounded before coincident points are merged


@dataclass(frozen=True)
class Footprint:
    """The footprint of one tip: its centre on the fruit and its side [mm], and its shape.

    `punch` returns the punch table of the shape for a number of nodes per side.
    """

    x: float
    y: float
    side: float
    punch: Callable[[int], Punch] = square_punch

    def nodes(self, per_side: int) -> Floats:
        """Return the positions of the nodes on the top of the block [mm], shape (nodes, 2)."""
        return np.asarray(self.side * self.punch(per_side).nodes + np.array([self.x, self.y]))

    def distance_to_edge(self, fruit: Fruit) -> float:
        """Return the distance from the centre to the nearest side face of a block [mm]."""
        return min(0.5 * fruit.length_mm - abs(self.x), 0.5 * fruit.width_mm - abs(self.y))


def closest_spacing(footprints: Sequence[Footprint]) -> float:
    """Return the smallest ratio of spacing to side over all pairs of footprints [1], or infinity for a single one.

    The spacing is the larger of the distances along x and along y.
    """
    closest = float(np.inf)
    for a, b in itertools.combinations(footprints, 2):
        spacing = max(abs(a.x - b.x), abs(a.y - b.y)) / max(a.side, b.side)
        closest = min(closest, spacing)
    return closest


class NodeCounts(NamedTuple):
    """Numbers of nodes per side of a footprint: for the interaction of tips, and for the loads of the remainder."""

    between: int
    within: int


def nodes_between(footprints: Sequence[Footprint]) -> int:
    """Return the number of nodes per side that the interaction between the tips requires."""
    closest = closest_spacing(footprints)
    return next(nodes for spacing, nodes in NODES_BETWEEN if closest >= spacing)


def nodes_within(fruit: Fruit, footprints: Sequence[Footprint]) -> int:
    """Return the number of nodes per side that the loads of the remainder require."""
    distances = []  # from the centre of each footprint to the nearest side face or to the base [sides]
    for footprint in footprints:
        distances.append(min(footprint.distance_to_edge(fruit), fruit.height_mm) / footprint.side)
    closest = min(distances)
    return next(nodes for smallest_distance, nodes in NODES_WITHIN if closest >= smallest_distance)


def mirror_images(footprints: Sequence[Footprint]) -> tuple[list[int], list[int]]:
    """Return the index of each footprint's mirror image in the plane x = 0, and in the plane y = 0.

    A list is empty if the mirror image of any footprint is not among the footprints.
    """
    images_at_x = [replace(each, x=-each.x) for each in footprints]
    images_at_y = [replace(each, y=-each.y) for each in footprints]
    return _indices_of(images_at_x, footprints), _indices_of(images_at_y, footprints)


def _indices_of(images: Sequence[Footprint], footprints: Sequence[Footprint]) -> list[int]:
    """Return the index of each image among the footprints, or an empty list if an image is not among them."""
    index = {footprint: i for i, footprint in enumerate(footprints)}
    if any(image not in index for image in images):
        return []
    return [index[image] for image in images]


def level_parities(footprints: Sequence[Footprint]) -> list[Parity]:
    """Return the parities of the loads that level footprints can have, each a sign for x and a sign for y.

    The sign is 1 if the loads are even about the mirror plane normal to this axis, and -1 if they are odd. The sign is
    0 if the footprints have no such mirror plane. If all centres lie in the plane, loads can only be even.
    """
    centres = np.array([(footprint.x, footprint.y) for footprint in footprints])
    signs: list[tuple[int, ...]] = []  # the possible signs for x, and for y
    for images, coordinates in zip(mirror_images(footprints), centres.T, strict=True):
        if not images:
            signs.append((0,))
        elif coordinates.any():
            signs.append((1, -1))
        else:  # all centres lie in the mirror plane
            signs.append((1,))
    return [(x, y) for x in signs[0] for y in signs[1]]


def half_space_coupling(footprints: Sequence[Footprint], poisson: float, per_side: int) -> Floats:
    """Return the compliance matrix of a half-space that couples the nodes of different footprints, times E [1/mm].

    The matrix has shape (nodes, nodes), with zeros between nodes of the same footprint. The entries are Boussinesq
    displacements under unit point forces, u = (1 - nu^2) / (pi E r). `per_side` is the number of nodes per side.
    """
    nodes = np.concatenate([footprint.nodes(per_side) for footprint in footprints])
    tip_of_node = np.repeat(np.arange(len(footprints)), per_side**2)
    x, y = nodes.T
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    distance[tip_of_node[:, None] == tip_of_node] = np.inf  # the punch table covers the effect of a tip on itself
    return np.asarray((1.0 - poisson**2) / np.pi / distance)


def node_remainder(
    fruit: Fruit, footprints: Sequence[Footprint], lines: Lines, parities: Sequence[Parity], counts: NodeCounts
) -> tuple[Floats, int]:
    """Return the compliance that the finite block adds to the half-space between all nodes, and the number of dofs.

    The compliance is multiplied by E [1/mm], and has shape (nodes, nodes), with `counts.between` nodes per side. To
    save solves, loads act on fewer nodes, `counts.within` per side, and the result is interpolated. The mesh is the box
    over `lines` [mm], which start at the mirror planes. A load is the mean of its even and its odd part about each
    mirror plane. These parts are solved for the given `parities` (see `level_parities`). Parts of other parities are
    assumed to be zero. Raises SolveError if a solve does not converge.
    """
    # A node outside the meshed part is replaced by its mirror image, which lies inside.
    nodes = np.concatenate([footprint.nodes(counts.within) for footprint in footprints])
    mirrored = np.abs(parities[0])  # for x and y: 1 if there is a mirror plane, otherwise 0
    is_replaced = mirrored * nodes < 0.0  # (nodes, 2), for x and y
    nodes = np.where(is_replaced, -nodes, nodes)
    first_node, load_of_node = _merge_coincident(nodes, max(footprint.side for footprint in footprints))
    load_compliances, dofs = remainder_compliance(box_mesh(lines), fruit.poisson, nodes[first_node], parities)

    compliance = np.zeros((len(nodes), len(nodes)))
    for parity, load_compliance in zip(parities, load_compliances, strict=True):
        # A node that was replaced by its mirror image has the sign of the parity.
        sign = np.where(is_replaced, parity, 1).prod(axis=1)
        compliance += np.outer(sign, sign) * load_compliance[np.ix_(load_of_node, load_of_node)]
    compliance /= 2 ** mirrored.sum()  # the mean of even and odd parts is half their sum for each mirror plane

    interpolation = _interpolation_matrix(footprints, counts)
    return interpolation @ compliance @ interpolation.T, dofs


def _merge_coincident(nodes: Floats, side: float) -> tuple[Ints, Ints]:
    """Merge nodes (nodes, 2) [mm] that coincide into loads, so that each load is solved only once.

    Returns the index of the first node of each load (loads,), and the index of the load of each node (nodes,). Nodes
    coincide if their positions divided by `side` [mm] agree to SAME_POINT decimals.
    """
    rounded = np.round(nodes / side, SAME_POINT) + 0.0  # adding 0 converts -0 to 0
    _, first_node, load_of_node = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return first_node, load_of_node


def _interpolation_matrix(footprints: Sequence[Footprint], counts: NodeCounts) -> Floats:
    """Return the matrix (all nodes, loaded nodes) [1] that interpolates with the nodal polynomials of each footprint.

    From `counts.within` loaded nodes per side of a footprint, it interpolates to `counts.between` nodes per side.
    """
    interpolations = []
    for footprint in footprints:
        interaction_nodes = footprint.punch(counts.between).nodes
        interpolations.append(footprint.punch(counts.within).interpolate(interaction_nodes))
    return np.asarray(block_diag(*interpolations))


@functools.lru_cache(maxsize=2)
def half_space_compliance(footprints: tuple[Footprint, ...], poisson: float) -> Floats:
    """Return the compliance of level footprints on a half-space, times E [1/mm].

    The array is cached, and therefore read-only. Raises SolveError if the forces have a large residual.
    """
    S = level_compliance(footprints, poisson, np.zeros(()), nodes_between(footprints))
    S.flags.writeable = False
    return S


def level_compliance(footprints: Sequence[Footprint], poisson: float, remainder: Floats, per_side: int) -> Floats:
    """Return the compliance of footprints that stay level, times E [1/mm], shape (footprints, footprints).

    `remainder` (nodes, nodes) [1/mm] is the compliance that the finite block adds between all nodes, times E. For a
    half-space, it is 0. `per_side` is the number of nodes per side of a footprint. Raises SolveError if the forces have
    a large residual, which indicates an invalid scene.
    """
    # Solve (I + Y G) F = Y d for the nodal forces F under a unit indentation d of each footprint in turn. Y holds the
    # stiffnesses of the footprints, and G the compliance that other tips and the finite size of the block add.
    G = remainder + half_space_coupling(footprints, poisson, per_side)
    stiffnesses = [footprint.side * footprint.punch(per_side).stiffness for footprint in footprints]
    Y = block_diag(*stiffnesses) / (1.0 - poisson**2)
    unit_displacements = np.repeat(np.eye(len(footprints)), per_side**2, axis=0)
    system = np.eye(len(G)) + Y @ G
    right_side = Y @ unit_displacements
    factor = lu_factor(system)
    forces = lu_solve(factor, right_side)
    forces += lu_solve(factor, right_side - system @ forces)  # one step of iterative refinement, which stiff skins need
    residual = float(np.abs(system @ forces - right_side).max() / np.abs(right_side).max())
    if not residual <= RESIDUAL_LIMIT:
        msg = f"tip forces: relative residual = {residual:.1e} must be at most {RESIDUAL_LIMIT:.0e}. Check the scene."
        raise SolveError(msg)
    # The nodal forces on each footprint add up to the stiffness matrix, whose inverse is the compliance.
    S = np.linalg.inv(unit_displacements.T @ forces)
    # By Betti's theorem, S is symmetric up to round-off. The mean is symmetric to the last bit.
    return 0.5 * (S + S.T)

"""Displacement and stress in the fruit under a given pressure on its tips, for display.

The fields are computed on the equivalent block of the fruit. As in `cad`, z points up, and the top face is at z = 0.
The fields are the sum of two parts. The field of a half-space has a closed form at each node. The remainder, which the
finite size of the block adds, is smooth and is solved on a mesh.
"""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from typing import NamedTuple

import numpy as np
from skfem import CellBasis, Mesh, MeshHex

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from sensor.quantity import validation_error
from solve.contact.pressure import FootprintPressure
from solve.contact.pressure_cells import FINE
from solve.elasticity import NodalFields, strain, stress
from solve.fruit.box import Lines, block_lines, box_mesh, graded_line
from solve.fruit.remainder import remainder_field
from solve.halfspace import potentials as halfspace
from solve.halfspace.punch import square_punch
from solve.surface import patch_inside

FINEST = 0.125  # smallest mesh step, under a tip [sides of its contact]
GROWTH = 0.4  # increase of the mesh step with the distance from a contact [mm per mm]
COARSEST = 0.1  # largest mesh step [longest edge of the block]
# Distance [sides of a contact] within which the patches of a tip are used; farther away, point forces replace them.
NEAR = 1.5
PATCHES = 24  # maximum number of patches per side of a footprint
NODES = 3  # number of point forces per side of the square that replace the patches of a tip
# Depth at which the surface stress is evaluated [sides of a patch]. On the surface itself, the stress is infinite at
# the corners of patches. At this depth, differences between patches have decayed by exp(-pi), whereas variations as
# wide as a tip have not.
STRESS_DEPTH = 0.5
# Depth at which the surface displacement is evaluated, to avoid 0 / 0, as a fraction of the depth for the stress.
DISPLACEMENT_DEPTH = 1e-6
UPWARD = np.array([1.0, 1.0, -1.0])  # converts vectors from z down to z up, and back


@dataclass(frozen=True, eq=False)
class _Patches:
    """Forces (n,) [N], each a uniform pressure on a rectangle with the centre (n, 2) and the sides (n, 2) [mm].

    A force whose sides are 0 acts at a point.
    """

    centres: Floats
    sides: Floats
    forces: Floats

    @property
    def low(self) -> Floats:
        """Return the smallest x and the smallest y of all rectangles [mm]."""
        return np.asarray((self.centres - 0.5 * self.sides).min(axis=0))

    @property
    def high(self) -> Floats:
        """Return the largest x and the largest y of all rectangles [mm]."""
        return np.asarray((self.centres + 0.5 * self.sides).max(axis=0))


class _TipLoad(NamedTuple):
    """The load of one tip in two forms: patches, and point forces with the same moments."""

    patches: _Patches
    point_forces: _Patches


def fruit_fields(fruit: Fruit, pressure: FootprintPressure) -> tuple[MeshHex, NodalFields]:
    """Return a hexahedral mesh of the fruit [mm], and the fields at its nodes under the pressure of all tips.

    The fields are displacement, stress and strain. The mesh is the equivalent block of the fruit, with z up. Raises
    InputError for a fruit with a skin, and SolveError if the solve for the remainder does not converge.
    """
    if fruit.skin_mm is not None:
        raise validation_error(
            "fruit.skin_mm", fruit.skin_mm, "mm", "left out, because fields are computed without a skin", "drop it"
        )
    block = fruit.equivalent_block
    loads = []
    for tip in range(len(pressure.forces)):
        patches = _loaded_patches(pressure, tip)
        if len(patches.forces):  # a tip out of contact has no load
            loads.append(_TipLoad(patches, _equivalent_point_forces(patches)))
    mesh = _viewing_mesh(block, [load.patches for load in loads])
    points = np.stack([mesh.p[0], mesh.p[1], -mesh.p[2]])  # with z down, as in the half-space solution

    # All fields are for E = 1 MPa and z down. Stress does not depend on E; displacement is proportional to 1 / E.
    u_remainder, gradient = _remainder(block, loads, points)
    u, sigma = _half_space_fields(block.poisson, loads, points)
    sigma = sigma + stress(gradient, 1.0, block.poisson)

    displacement = (u + u_remainder).T * UPWARD / pressure.E
    sigma = sigma * np.multiply.outer(UPWARD, UPWARD)[:, :, None]  # reverses the sign of the xz and yz components
    return mesh, NodalFields(displacement=displacement, stress=sigma, strain=strain(sigma, pressure.E, block.poisson))


def _remainder(block: Fruit, loads: Sequence[_TipLoad], points: Floats) -> tuple[Floats, Floats]:
    """Return the remainder (3, n) [mm] at points (3, n) [mm] and its gradient (3, 3, n), for E = 1 MPa.

    The remainder is the displacement that the finite size of the block adds to a half-space. It is smooth, so point
    forces are accurate enough as loads. Raises SolveError if the solve does not converge.
    """
    load_points = np.concatenate([load.point_forces.centres for load in loads])
    forces = np.concatenate([load.point_forces.forces for load in loads])
    lines = block_lines(block, load_points, (False, False), FINE)  # the whole block, without mirror planes
    basis, v = remainder_field(box_mesh(lines), block.poisson, load_points, forces)
    return _evaluate_field(basis, lines, v, points)


def _half_space_fields(poisson: float, loads: Sequence[_TipLoad], points: Floats) -> tuple[Floats, Floats]:
    """Return the displacement (3, n) [mm] and the stress (3, 3, n) [MPa] of a half-space with E = 1 MPa.

    `points` (3, n) [mm] are the positions, with z down. On the surface, the stress is evaluated at a small depth,
    because it is infinite at the corners of patches. The displacement is evaluated at a much smaller depth, which
    avoids 0 / 0.
    """
    x, y, z = points
    stress_depth = STRESS_DEPTH * min(float(load.patches.sides.min()) for load in loads)
    potentials = _half_space_potentials(np.stack([x, y, np.maximum(z, stress_depth)]), loads)
    u = halfspace.displacement(potentials, 1.0, poisson)
    # Replace the displacements of the points on the surface, which were computed at the depth for the stress.
    on_top = z == 0.0
    near_top = np.stack([x[on_top], y[on_top], np.full(np.count_nonzero(on_top), DISPLACEMENT_DEPTH * stress_depth)])
    u[:, on_top] = halfspace.displacement(_half_space_potentials(near_top, loads), 1.0, poisson)
    return u, halfspace.stress(potentials, poisson)


def _loaded_patches(pressure: FootprintPressure, tip: int) -> _Patches:
    """Return the patches of one tip that carry a force; `tip` is the index of the tip.

    A patch is a block of neighbouring cells, and carries their total force. Merging the cells limits the cost of the
    potentials: there are at most 24 x 24 patches.
    """
    cells_per_side = len(pressure.edges) - 1
    cells_per_patch = math.ceil(cells_per_side / PATCHES)
    first_cells = np.arange(0, cells_per_side, cells_per_patch)  # the first cell of each patch along a side
    edges = np.append(pressure.edges[first_cells], pressure.edges[-1])
    # Add the forces of the cells in each patch, first along x and then along y.
    row_forces = np.add.reduceat(pressure.cell_forces[tip], first_cells, axis=0)
    forces = np.add.reduceat(row_forces, first_cells, axis=1).ravel()
    is_loaded = forces > 0.0
    centres = _pairs(0.5 * (edges[1:] + edges[:-1]))[is_loaded] + pressure.centres[tip]
    return _Patches(centres, _pairs(np.diff(edges))[is_loaded], forces[is_loaded])


def _pairs(values: Floats) -> Floats:
    """Return all ordered pairs of the values (n,), shape (n^2, 2)."""
    return np.stack(np.meshgrid(values, values, indexing="ij"), axis=-1).reshape(-1, 2)


def _equivalent_point_forces(patches: _Patches) -> _Patches:
    """Return forces at nine points that have the same moments as the patches of a tip."""
    middle = 0.5 * (patches.low + patches.high)
    side = float((patches.high - patches.low).max())
    table = square_punch(NODES)
    forces = table.interpolate((patches.centres - middle) / side).T @ patches.forces
    return _Patches(middle + side * table.nodes, np.zeros((NODES**2, 2)), forces)


def _viewing_mesh(block: Fruit, patches_of_tips: Sequence[_Patches]) -> MeshHex:
    """Return the mesh for display [mm], with z up: fine under the contacts of the tips, and coarse elsewhere.

    `patches_of_tips` holds the patches of each tip in contact. The boundaries of the mesh are named "top" and "base".
    """
    smallest_step = FINEST * min(float((patches.high - patches.low).max()) for patches in patches_of_tips)
    extent = (block.length_mm, block.width_mm, block.height_mm)
    largest_step = COARSEST * max(extent)
    steps = (smallest_step, largest_step)

    lines = []
    for axis in (0, 1):
        spans = [np.array([patches.low[axis], patches.high[axis]]) for patches in patches_of_tips]
        start = -0.5 * extent[axis]  # the block is centred at x = y = 0
        lines.append(_grid_line(start, start + extent[axis], spans, steps))
    depths = _grid_line(0.0, block.height_mm, [np.zeros(2)], steps)  # densest at the top face
    tolerance = 1e-9 * block.height_mm  # for round-off in the coordinates of a face
    heights = -depths[::-1]  # z increases from the base to the top face at z = 0
    return MeshHex.init_tensor(lines[0], lines[1], heights).with_boundaries(
        {"top": lambda point: point[2] > -tolerance, "base": lambda point: point[2] < tolerance - block.height_mm}
    )


def _grid_line(start: float, end: float, spans: Sequence[Floats], steps: tuple[float, float]) -> Floats:
    """Return grid coordinates from `start` to `end` [mm], densest in the given spans.

    Each span (2,) [mm] has a lower and an upper limit. `steps` are the step in a span and the largest step [mm].
    """
    smallest_step, largest_step = steps

    def step_size(coordinates: Floats) -> Floats:
        """Return the largest step [mm] at coordinates along the line, which grows with the distance from a span."""
        distance = np.full_like(coordinates, np.inf)
        for low, high in spans:
            outside = np.maximum(np.maximum(low - coordinates, coordinates - high), 0.0)  # 0 inside the span
            distance = np.minimum(distance, outside)
        return np.minimum(smallest_step + GROWTH * distance, largest_step)

    return graded_line(start, end, step_size)


def _evaluate_field(basis: CellBasis, lines: Lines, v: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return a displacement field (3, n) [mm] and its gradient (3, 3, n) [1] at points (3, n) [mm].

    `v` (dofs,) [mm] holds the displacements in the `basis` of a box of hexahedra, called bricks, between the grid
    `lines`. The second axis of the gradient is the coordinate of differentiation.
    """
    bricks = _find_bricks(basis.mesh, lines, points)
    # The map from the unit cube to a brick is affine. Its inverse gives the coordinates of each point in the cube.
    origin = np.zeros((3, 1))
    inverse = basis.mapping.invDF(origin, tind=bricks)[..., 0]
    from_corner = points - basis.mapping.F(origin, tind=bricks)[..., 0]
    local_points = np.einsum("ijn,jn->in", inverse, from_corner)[:, :, None]

    # There is one point in each of n bricks, so its quadrature weight of 1 has no effect. Indices: node k, component c,
    # brick n, point q, coordinate d.
    patch = patch_inside(basis, bricks, local_points, np.ones((len(bricks), 1)))
    nodal_values = v[patch.dofs]
    values = np.einsum("kcn,knq->cn", nodal_values, patch.shapes)
    gradient = np.einsum("kcn,kdnq->cdn", nodal_values, patch.gradients)
    return values, gradient


def _find_bricks(mesh: Mesh, lines: Lines, points: Floats) -> Ints:
    """Return the index of the brick that contains each of the points (3, n) [mm], shape (n,).

    Bricks are found from the grid lines between them, which is faster than the search in a general mesh.
    """
    # `brick_index` maps the grid intervals along the three axes to the index of a brick in the mesh. It is filled by
    # locating the centres of all bricks.
    brick_index = np.empty([len(line) - 1 for line in lines], dtype=np.int64)
    brick_index[_intervals(lines, mesh.p[:, mesh.t].mean(axis=1))] = np.arange(mesh.t.shape[1])
    return brick_index[_intervals(lines, points)]


def _intervals(lines: Lines, points: Floats) -> tuple[Ints, ...]:
    """Return, for each axis, the indices (n,) of the grid intervals that contain points (3, n)."""
    intervals = []
    for line, coordinates in zip(lines, points, strict=True):
        interval = np.searchsorted(line, coordinates, side="right") - 1
        intervals.append(np.clip(interval, 0, len(line) - 2))  # a point on the last grid line is in the last interval
    return tuple(intervals)


def _half_space_potentials(points: Floats, loads: Sequence[_TipLoad]) -> halfspace.Potentials:
    """Return the potentials of the half-space at points (3, n) [mm], with z down, under the pressures of all tips.

    The patches of a tip are used near it. Elsewhere its nine point forces are used, which are accurate at a distance
    and cost much less.
    """
    x, y, z = points
    potential_sums = np.zeros((len(fields(halfspace.Potentials)), len(x)))
    potential_sums[0] = z  # the first field of the potentials is the depth; the others are sums over the loads
    for patches, point_forces in loads:
        middle = point_forces.centres.mean(axis=0)
        contact_side = float(np.ptp(patches.centres, axis=0).max() + patches.sides.max())
        reach = NEAR * contact_side  # the patches are used up to this distance along each axis [mm]
        is_near = np.maximum(np.maximum(np.abs(x - middle[0]), np.abs(y - middle[1])), z) <= reach
        potential_sums[1:, is_near] += _summed_potentials(x[is_near], y[is_near], z[is_near], patches)
        potential_sums[1:, ~is_near] += _summed_potentials(x[~is_near], y[~is_near], z[~is_near], point_forces)
    return halfspace.Potentials(*potential_sums)


def _summed_potentials(x: Floats, y: Floats, z: Floats, loads: _Patches) -> Floats:
    """Return the sums of the potentials of all loads at points x, y, z (n,) [mm], shape (potentials, n).

    The first field of `Potentials` is the depth z, which is the same for all loads, so it is left out.
    """
    potential_sums = np.zeros((len(fields(halfspace.Potentials)) - 1, len(x)))
    for centre, (a, b), force in zip(loads.centres, loads.sides.tolist(), loads.forces, strict=True):
        dx = x - centre[0]
        dy = y - centre[1]
        if a > 0.0:
            unit_potentials = halfspace.rectangle_load(dx, dy, z, a, b)  # for a pressure of 1 MPa
            intensity = force / (a * b)  # pressure [MPa]
        else:  # the force acts at a point
            unit_potentials = halfspace.point_load(dx, dy, z)  # for a force of 1 N
            intensity = force  # [N]
        potential_sums += intensity * np.asarray(astuple(unit_potentials)[1:])  # without the depth
    return potential_sums

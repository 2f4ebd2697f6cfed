"""Displacement and stress in the fruit under given pressures, for viewing: half-space part plus remainder.

The fields are on the equivalent block of the fruit, in the axes of cad: z up, top face at 0. The half-space part is in
closed form at every node, the remainder is smooth.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields

import numpy as np
from skfem import CellBasis, MeshHex

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

FINEST = 0.125  # mesh step under a tip [sides of its contact]
GROWTH = 0.4  # growth of the mesh steps per distance from a contact
COARSEST = 0.1  # largest mesh step [lengths of the block]
NEAR = 1.5  # distance [sides of a contact] up to which patches of pressure are resolved; beyond, only their moments
PATCHES = 24  # most patches per side of a footprint; each sums the forces of its cells
NODES = 3  # nodes per side that carry the moments of the patches of a tip
# Depth [sides of a patch] at which surface stress is evaluated. At the corners of patches it is infinite on the
# surface. At this depth the steps between patches have decayed by exp(-pi), but variations as wide as a tip have not.
SKIN = 0.5
SURFACE = 1e-6  # depth [SKIN depths] at which surface displacement is evaluated, to avoid 0 / 0 in its closed form
UPWARD = np.array([1.0, 1.0, -1.0])  # converts a vector from z down to z up


@dataclass(frozen=True, eq=False)
class _Patches:
    """Uniform pressures on rectangles: centres (n, 2), sides (n, 2) [mm], forces (n,) [N]; no sides for points."""

    centres: Floats
    sides: Floats
    forces: Floats

    @property
    def low(self) -> Floats:
        """Return the lowest x and y of all rectangles [mm]."""
        return np.asarray((self.centres - 0.5 * self.sides).min(axis=0))

    @property
    def high(self) -> Floats:
        """Return the highest x and y of all rectangles [mm]."""
        return np.asarray((self.centres + 0.5 * self.sides).max(axis=0))


def fruit_fields(fruit: Fruit, pressure: FootprintPressure) -> tuple[MeshHex, NodalFields]:
    """Return hexahedra of the fruit [mm] and the fields under the pressures of all tips, in the order of `mesh.p`.

    Raises InputError for a fruit with a skin, and SolveError if the solve of the remainder does not converge.
    """
    if fruit.skin_mm is not None:
        raise validation_error("fruit.skin_mm", fruit.skin_mm, "mm", "left out for fields", "drop it")
    block = fruit.equivalent_block
    tips = []
    for tip in range(len(pressure.forces)):
        patches = _patches(pressure, tip)
        if len(patches.forces):
            tips.append(patches)
    point_loads = [_as_points(patches) for patches in tips]
    mesh = _view_mesh(block, tips)
    x, y, z = mesh.p * UPWARD[:, None]  # from here on z points down

    # All fields are for E = 1 MPa; the last lines divide by E.
    load_points = np.concatenate([each.centres for each in point_loads])
    forces = np.concatenate([each.forces for each in point_loads])
    lines = block_lines(block, load_points, (False, False), FINE)
    basis, v = remainder_field(box_mesh(lines), block.poisson, load_points, forces)
    u_remainder, gradient = _evaluated(basis, lines, v, np.stack([x, y, z]))

    # The half-space in closed form; surface stress is evaluated slightly below the surface.
    skin = SKIN * min(float(patches.sides.min()) for patches in tips)
    loads = list(zip(tips, point_loads, strict=True))
    below_skin = _half_space(np.stack([x, y, np.maximum(z, skin)]), loads)
    u = halfspace.displacement(below_skin, 1.0, block.poisson)
    top = z == 0.0
    near_top = np.stack([x[top], y[top], np.full(np.count_nonzero(top), SURFACE * skin)])
    u[:, top] = halfspace.displacement(_half_space(near_top, loads), 1.0, block.poisson)
    sigma = halfspace.stress(below_skin, block.poisson) + stress(gradient, 1.0, block.poisson)

    displacement = (u + u_remainder).T * UPWARD / pressure.E
    sigma = sigma * np.multiply.outer(UPWARD, UPWARD)[:, :, None]
    return mesh, NodalFields(displacement=displacement, stress=sigma, strain=strain(sigma, pressure.E, block.poisson))


def _patches(pressure: FootprintPressure, tip: int) -> _Patches:
    """Return the pressure of one tip, summed over at most 24 x 24 rectangles of cells; empty without a force."""
    count = len(pressure.edges) - 1
    first = np.arange(0, count, -(-count // PATCHES))
    edges = np.append(pressure.edges[first], pressure.edges[-1])
    total = np.add.reduceat(np.add.reduceat(pressure.cell_forces[tip], first, axis=0), first, axis=1).ravel()
    loaded = total > 0.0
    centres = _pairs(0.5 * (edges[1:] + edges[:-1]))[loaded] + pressure.centres[tip]
    return _Patches(centres, _pairs(np.diff(edges))[loaded], total[loaded])


def _pairs(values: Floats) -> Floats:
    """Return all pairs of values, shape (n^2, 2)."""
    return np.stack(np.meshgrid(values, values, indexing="ij"), axis=-1).reshape(-1, 2)


def _as_points(patches: _Patches) -> _Patches:
    """Return the forces on nine points that have the moments of the patches; their sides are 0."""
    middle = 0.5 * (patches.low + patches.high)
    side = float((patches.high - patches.low).max())
    table = square_punch(NODES)
    forces = table.interpolate((patches.centres - middle) / side).T @ patches.forces
    return _Patches(middle + side * table.nodes, np.zeros((NODES**2, 2)), forces)


def _view_mesh(block: Fruit, tips: Sequence[_Patches]) -> MeshHex:
    """Return the cells for viewing [mm], z up: fine under the contacts, coarse elsewhere.

    Steps are FINEST within a contact and grow with the distance from it, up to COARSEST of the longest edge.
    """
    finest = FINEST * min(float((patches.high - patches.low).max()) for patches in tips)
    extent = (block.length_mm, block.width_mm, block.height_mm)
    largest = COARSEST * max(extent)

    def graded(start: float, end: float, spans: Sequence[Floats]) -> Floats:
        """Return a line from start to end [mm] whose steps grow with the distance from the nearest span (2,) [mm]."""

        def size(s: Floats) -> Floats:
            distance = np.full_like(s, np.inf)
            for low, high in spans:
                distance = np.minimum(distance, np.maximum(np.maximum(low - s, s - high), 0.0))
            return np.minimum(finest + GROWTH * distance, largest)

        return graded_line(start, end, size)

    lines = []
    for axis in (0, 1):
        spans = [np.array([patches.low[axis], patches.high[axis]]) for patches in tips]
        start = -0.5 * extent[axis]
        lines.append(graded(start, start + extent[axis], spans))
    down = graded(0.0, block.height_mm, [np.zeros(2)])
    near = 1e-9 * block.height_mm
    return MeshHex.init_tensor(lines[0], lines[1], -down[::-1]).with_boundaries(
        {"top": lambda point: point[2] > -near, "base": lambda point: point[2] < near - block.height_mm}
    )


def _evaluated(basis: CellBasis, lines: Lines, v: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Return a field and its gradient at points (3, n) [mm], shapes (3, n) and (3, 3, n) with the derivative last.

    `v` (dofs,) are the field's values on the box of bricks between the `lines`.
    """
    mesh = basis.mesh
    # The brick that contains each point, by the intervals of the lines along each axis.
    number = np.empty([len(line) - 1 for line in lines], dtype=np.int64)
    number[_intervals(lines, mesh.p[:, mesh.t].mean(axis=1))] = np.arange(mesh.t.shape[1])
    bricks = number[_intervals(lines, points)]

    # The map from the unit cube to a brick is linear; its inverse gives the coordinates of a point in the cube.
    origin = np.zeros((3, 1))
    inverse = basis.mapping.invDF(origin, tind=bricks)[..., 0]
    from_corner = points - basis.mapping.F(origin, tind=bricks)[..., 0]
    inside = np.einsum("ijn,jn->in", inverse, from_corner)[:, :, None]

    # One point in each of n bricks: indices node k, component c, brick n, point q.
    patch = patch_inside(basis, bricks, inside, np.ones((len(bricks), 1)))
    local = v[patch.dofs]
    value = np.einsum("kcn,knq->cn", local, patch.shapes)
    gradient = np.einsum("kcn,kdnq->cdn", local, patch.gradients)
    return value, gradient


def _intervals(lines: Lines, points: Floats) -> tuple[Ints, ...]:
    """Return, for each axis, the interval between lines that contains a coordinate."""
    intervals = []
    for line, coordinates in zip(lines, points, strict=True):
        interval = np.searchsorted(line, coordinates, side="right") - 1
        intervals.append(np.clip(interval, 0, len(line) - 2))
    return tuple(intervals)


def _half_space(points: Floats, loads: Sequence[tuple[_Patches, _Patches]]) -> halfspace.Potentials:
    """Return the potentials at points (3, n) [mm], z down, under the pressures of all tips.

    Each tip has two loads: patches of pressure, used near the tip, and points with their moments, used elsewhere.
    """
    x, y, z = points
    total = np.zeros((len(fields(halfspace.Potentials)), len(x)))
    total[0] = z  # the first field of the potentials is the depth; the others are sums over the loads
    for patches, as_points in loads:
        middle = as_points.centres.mean(axis=0)
        reach = NEAR * float(np.ptp(patches.centres, axis=0).max() + patches.sides.max())
        near = np.maximum(np.maximum(np.abs(x - middle[0]), np.abs(y - middle[1])), z) <= reach
        total[1:, near] += _potentials(x[near], y[near], z[near], patches)
        total[1:, ~near] += _potentials(x[~near], y[~near], z[~near], as_points)
    return halfspace.Potentials(*total)


def _potentials(x: Floats, y: Floats, z: Floats, loads: _Patches) -> Floats:
    """Return the potentials except z of forces on rectangles, or on points if the sides are 0."""
    total = np.zeros((len(fields(halfspace.Potentials)) - 1, len(x)))
    for centre, (a, b), force in zip(loads.centres, loads.sides.tolist(), loads.forces, strict=True):
        dx = x - centre[0]
        dy = y - centre[1]
        unit = halfspace.rectangle_load(dx, dy, z, a, b) if a > 0.0 else halfspace.point_load(dx, dy, z)
        # a pressure force / (a b) on a rectangle, or the force itself at a point, whose sides are 0
        total += force / (a * b or 1.0) * np.asarray(astuple(unit)[1:])
    return total

"""Displacement and stress in the fruit under given pressures, for viewing: half-space part plus remainder.

Drawn on the block that the fruit counts as, in the axes of cad: z up, top face at 0. The half-space part is in closed
form at every node, the remainder is smooth.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from functools import partial

import numpy as np
from skfem import CellBasis, MeshHex

from cad.design.fruit import Fruit
from solve.arrays import Floats, Ints
from solve.contact.cells import GRADING
from solve.contact.pressure import FootprintPressure
from solve.elasticity import strain, stress
from solve.fruit.box import UP, Lines, block_lines, box_mesh, graded_line
from solve.fruit.remainder import remainder_field
from solve.halfspace import potentials as halfspace
from solve.halfspace.punch import square_punch
from solve.nodal_fields import NodalFields
from solve.surface import patch_inside

FINEST = 0.125  # step under a tip [sides of what touches]
GROWTH = 0.4
COARSEST = 0.1  # [lengths of the block]
NEAR = 1.5  # within these sides of a tip its patches of pressure are seen, beyond only their moments
PATCHES = 24
NODES = 3
# Depth [sides of a patch] at which stress of the surface is taken: at the corners of patches it is infinite, and so
# deep the steps between them have faded by exp(-pi), while what is as wide as a tip has not.
SKIN = 0.5
SURFACE = 1e-6  # depth [skin] at which displacement of the surface is taken, where its closed form has no 0 / 0
UPWARD = np.array([1.0, 1.0, -1.0])  # turns a vector from z down to z up


@dataclass(frozen=True, eq=False)
class _Patches:
    """Uniform pressures on rectangles: centres (n, 2), sides (n, 2) [mm], forces (n,) [N]."""

    centres: Floats
    sides: Floats
    forces: Floats

    @property
    def lower(self) -> Floats:
        return np.asarray((self.centres - 0.5 * self.sides).min(axis=0))

    @property
    def upper(self) -> Floats:
        return np.asarray((self.centres + 0.5 * self.sides).max(axis=0))


def fruit_fields(fruit: Fruit, pressure: FootprintPressure) -> tuple[MeshHex, NodalFields]:
    """Return hexahedra of the fruit [mm] and the fields under the pressures of all tips, in the order of `mesh.p`.

    Raises SolveError when the solve of the remainder is not exact.
    """
    block = fruit.equivalent_block
    extent = (block.length_mm, block.width_mm, block.height_mm)
    every = [_patches(pressure, tip) for tip in range(len(pressure.forces))]
    tips = [patches for patches in every if len(patches.forces)]
    lines = _view_lines(extent, tips)
    u, sigma = _unit_fields(block, tips, lines)
    mesh, nodes = _view_mesh(lines)
    sigma = sigma.reshape(3, 3, -1)[:, :, nodes] * np.multiply.outer(UPWARD, UPWARD)[:, :, None]
    displacement = u.reshape(3, -1)[:, nodes].T * UPWARD / pressure.E
    return mesh, NodalFields(displacement=displacement, stress=sigma, strain=strain(sigma, pressure.E, block.poisson))


def _unit_fields(block: Fruit, tips: Sequence[_Patches], lines: Lines) -> tuple[Floats, Floats]:
    """Return displacement times E (3, nx, ny, nz) [N/mm] and stress (3, 3, nx, ny, nz) [MPa] on crossings of lines."""
    points = [_as_points(patches) for patches in tips]
    basis, v = _remainder(block, points)
    skin = SKIN * min(float(patches.sides.min()) for patches in tips)
    near = _half_space((*lines[:2], np.maximum(lines[2], skin)), tips, points)
    top = _half_space((*lines[:2], np.array([SURFACE * skin])), tips, points)
    smooth, gradient = _evaluated(basis, v, lines)
    u = halfspace.displacement(near, 1.0, block.poisson) + smooth
    u[..., :1] = halfspace.displacement(top, 1.0, block.poisson) + smooth[..., :1]
    return u, halfspace.stress(near, block.poisson) + stress(gradient, 1.0, block.poisson)


def _remainder(block: Fruit, points: Sequence[_Patches]) -> tuple[CellBasis, Floats]:
    places, forces = np.concatenate([one.centres for one in points]), np.concatenate([one.forces for one in points])
    mesh = box_mesh(block_lines(block, places, (False, False), GRADING))
    return remainder_field(mesh, block.poisson, places, forces)


def _patches(pressure: FootprintPressure, tip: int) -> _Patches:
    """Return the pressure of one tip summed over at most 12 x 12 rectangles of cells."""
    count = len(pressure.edges) - 1
    first = np.arange(0, count, -(-count // PATCHES))
    edges = np.append(pressure.edges[first], pressure.edges[-1])
    total = np.add.reduceat(np.add.reduceat(pressure.cell_forces[tip], first, axis=0), first, axis=1).ravel()
    centres, sides = _pairs(0.5 * (edges[1:] + edges[:-1])), _pairs(np.diff(edges))
    loaded = total > 0.0
    return _Patches(centres[loaded] + pressure.centres[tip], sides[loaded], total[loaded])


def _pairs(values: Floats) -> Floats:
    """Return all pairs of values, shape (n^2, 2)."""
    return np.stack(np.meshgrid(values, values, indexing="ij"), axis=-1).reshape(-1, 2)


def _as_points(patches: _Patches) -> _Patches:
    """Return forces on nine nodes with the moments of the patches, of no extent."""
    middle, side = 0.5 * (patches.lower + patches.upper), float((patches.upper - patches.lower).max())
    table = square_punch(NODES)
    forces = table.interpolate((patches.centres - middle) / side).T @ patches.forces
    return _Patches(middle + side * table.nodes, np.zeros((NODES**2, 2)), forces)


def _view_lines(extent: tuple[float, float, float], tips: Sequence[_Patches]) -> Lines:
    """Return the lines of the cells to be drawn, z down: fine under what touches, coarse elsewhere."""
    finest = FINEST * min(float((patches.upper - patches.lower).max()) for patches in tips)
    lines = []
    for axis in range(3):
        spans = [(0.0, 0.0)] if axis == UP else [(patches.lower[axis], patches.upper[axis]) for patches in tips]
        start = 0.0 if axis == UP else -0.5 * extent[axis]
        size = partial(_view_size, spans=spans, finest=finest, largest=COARSEST * max(extent))
        lines.append(graded_line(start, start + extent[axis], size))
    return lines[0], lines[1], lines[2]


def _view_size(s: Floats, *, spans: Sequence[tuple[float, float]], finest: float, largest: float) -> Floats:
    away = np.full_like(s, np.inf)
    for start, end in spans:
        away = np.minimum(away, np.maximum(np.maximum(start - s, s - end), 0.0))
    return np.minimum(finest + GROWTH * away, largest)


def _evaluated(basis: CellBasis, v: Floats, lines: Lines) -> tuple[Floats, Floats]:
    """Return v (3, nx, ny, nz) and its gradient (3, 3, nx, ny, nz), derivative last, on the crossings of lines."""
    shape = tuple(len(line) for line in lines)
    places = np.stack(np.meshgrid(*lines, indexing="ij")).reshape(3, -1)
    cells = _cells_at(basis.mesh, lines)
    patch = patch_inside(basis, cells, _inside(basis, cells, places), np.ones((len(cells), 1)))
    local = v[patch.dofs]
    value = np.einsum("kcn,knq->cn", local, patch.shapes)
    gradient = np.einsum("kcn,kdnq->cdn", local, patch.gradients)
    return value.reshape(3, *shape), gradient.reshape(3, 3, *shape)


def _inside(basis: CellBasis, cells: Ints, places: Floats) -> Floats:
    """Return places (3, n) in the unit cubes of their brick-shaped cells, shape (3, n, 1)."""
    origin = np.zeros((3, 1))
    inverse = basis.mapping.invDF(origin, tind=cells)[..., 0]
    away = places - basis.mapping.F(origin, tind=cells)[..., 0]
    return np.asarray(np.einsum("ijn,jn->in", inverse, away)[:, :, None])


def _cells_at(mesh: MeshHex, lines: Lines) -> Ints:
    """Return the cell of a box in which each crossing of lines lies, shape (crossings,)."""
    corners = [np.unique(np.round(axis, 12)) for axis in mesh.p]
    middles = mesh.p[:, mesh.t].mean(axis=1)
    number = np.empty([len(corner) - 1 for corner in corners], dtype=np.int64)
    number[_below(corners, middles)] = np.arange(mesh.t.shape[1])
    found: Ints = number[np.ix_(*_below(corners, lines))].ravel()
    return found


def _below(corners: Sequence[Floats], places: Sequence[Floats]) -> tuple[Ints, ...]:
    """Return, for each axis, the interval between corners that a coordinate lies in."""
    pairs = zip(corners, places, strict=True)
    return tuple(np.clip(np.searchsorted(line, at, side="right") - 1, 0, len(line) - 2) for line, at in pairs)


def _half_space(lines: Lines, tips: Sequence[_Patches], points: Sequence[_Patches]) -> halfspace.Potentials:
    """Return the sum of the potentials of all loads on the crossings of lines: patches near a tip, points beyond."""
    x, y, z = np.meshgrid(*lines, indexing="ij")
    total = np.zeros((len(fields(halfspace.Potentials)), *x.shape))
    total[0] = z
    for patches, nodes in zip(tips, points, strict=True):
        middle = nodes.centres.mean(axis=0)
        reach = NEAR * float(np.ptp(patches.centres, axis=0).max() + patches.sides.max())
        near = np.maximum(np.maximum(np.abs(x - middle[0]), np.abs(y - middle[1])), z) <= reach
        for chosen, loads in ((near, patches), (~near, nodes)):
            total[1:, chosen] += _potentials((x[chosen], y[chosen], z[chosen]), loads)
    return halfspace.Potentials(*total)


def _potentials(places: Lines, loads: _Patches) -> Floats:
    """Return the potentials but for z of forces on rectangles, or at points where the sides are 0."""
    x, y, z = places
    summed = np.zeros((len(fields(halfspace.Potentials)) - 1, len(x)))
    for centre, (a, b), force in zip(loads.centres, loads.sides.tolist(), loads.forces, strict=True):
        away = x - centre[0], y - centre[1], z
        unit = halfspace.rectangle_load(*away, (a, b)) if a > 0.0 else halfspace.point_load(*away)
        summed += force / (a * b or 1.0) * np.asarray(astuple(unit)[1:])
    return summed


def _view_mesh(lines: Lines) -> tuple[MeshHex, Ints]:
    """Return the mesh [mm] with z up on lines with z down, and for each of its nodes which crossing of lines it is."""
    mesh = MeshHex.init_tensor(lines[0], lines[1], -lines[2][::-1])
    height = lines[2][-1]
    mesh = mesh.with_boundaries(
        {"top": lambda place: place[2] > -1e-9 * height, "base": lambda place: place[2] < (1e-9 - 1.0) * height}
    )
    pairs = zip(lines, mesh.p * UPWARD[:, None], strict=True)
    along = tuple(np.searchsorted(0.5 * (line[1:] + line[:-1]), at) for line, at in pairs)
    return mesh, np.ravel_multi_index(along, tuple(map(len, lines)))

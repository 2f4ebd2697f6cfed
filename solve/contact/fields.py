"""Displacement and von Mises stress in the fruit under given pressures, for viewing: half-space part plus remainder.

Drawn on the block that the fruit counts as, in the axes of cad: z up, top face at 0.
"""

from dataclasses import astuple, dataclass, fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import CellBasis, MeshHex

from cad.design.parameters import Fruit
from solve.contact.cells import GRADING
from solve.contact.pressure import FootprintPressure
from solve.elasticity import stress, von_mises
from solve.fruit.box import block_lines, box_mesh, graded_line
from solve.fruit.remainder import remainder_field
from solve.halfspace import potentials as halfspace
from solve.halfspace.punch import square_punch

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Lines = tuple[Floats, Floats, Floats]

FINEST = 0.125  # step under a tip [sides of what touches]
GROWTH = 0.4
COARSEST = 0.1  # [lengths of the block]
NEAR = 1.5  # within these sides of a tip its patches of pressure are seen, beyond only their moments
PATCHES = 12
NODES = 3


@dataclass(frozen=True, kw_only=True)
class FruitFields:
    """Hexahedra of the fruit [mm], displacement (points, 3) [mm] in the order of `mesh.p`, von Mises (cells,) [MPa]."""

    mesh: MeshHex
    displacement: Floats
    von_mises: Floats


@dataclass(frozen=True)
class _Patches:
    """Uniform pressures on rectangles: centres (n, 2), sides (n, 2) [mm], forces (n,) [N]."""

    centres: Floats
    sides: Floats
    forces: Floats


def fruit_fields(fruit: Fruit, pressure: FootprintPressure) -> FruitFields:
    """Return the fields under the pressures of both tips; stress at the centres of cells, where it is finite.

    Raises SolveError when the solve of the remainder is not exact.
    """
    block = fruit.equivalent_block
    tips = [_patches(pressure, tip) for tip in (0, 1)]
    points = [_as_points(one) for one in tips]
    lines = _view_lines(block, tips)
    x, y, z = (0.5 * (line[1:] + line[:-1]) for line in lines)
    middles = (x, y, z)
    places = np.concatenate([one.centres for one in points])
    forces = np.concatenate([one.forces for one in points])
    extent = (block.length_mm, block.width_mm, block.height_mm)
    mesh = box_mesh(block_lines(extent, places, (False, False), GRADING))
    basis, v = remainder_field(mesh, block.poisson, places, forces)
    grid = _on_grid(basis, v)
    shift = _interpolated(grid, lines)[0]
    gradient = _interpolated(grid, middles)[1]
    u = (halfspace.displacement(_half_space(lines, tips, points), 1.0, block.poisson) + shift) / pressure.E
    smooth = stress(gradient, 1.0, block.poisson)
    return _fields(lines, u, halfspace.stress(_half_space(middles, tips, points), block.poisson) + smooth)


def _patches(pressure: FootprintPressure, tip: int) -> _Patches:
    """Return the pressure of one tip summed over at most 12 x 12 rectangles of cells."""
    count = len(pressure.edges) - 1
    first = np.arange(0, count, -(-count // PATCHES))
    edges = np.append(pressure.edges[first], pressure.edges[-1])
    total = np.add.reduceat(np.add.reduceat(pressure.cell_forces[tip], first, axis=0), first, axis=1).ravel()
    middle, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    centres, sides = (np.stack(np.meshgrid(one, one, indexing="ij"), axis=-1).reshape(-1, 2) for one in (middle, width))
    loaded = total > 0.0
    return _Patches(centres[loaded] + np.array([pressure.centres[tip], 0.0]), sides[loaded], total[loaded])


def _as_points(patches: _Patches) -> _Patches:
    """Return forces on nine nodes with the moments of the patches, of no extent."""
    if not len(patches.forces):
        return patches
    low, high = (patches.centres - 0.5 * patches.sides).min(axis=0), (patches.centres + 0.5 * patches.sides).max(axis=0)
    middle, side = 0.5 * (low + high), float((high - low).max())
    table = square_punch(NODES)
    forces = table.interpolate((patches.centres - middle) / side).T @ patches.forces
    return _Patches(middle + side * table.nodes, np.zeros((NODES**2, 2)), forces)


def _view_lines(block: Fruit, tips: list[_Patches]) -> Lines:
    """Return the lines of the cells to be drawn, z down: fine under what touches, coarse elsewhere."""
    loaded = [one for one in tips if len(one.forces)]
    boxes = [
        ((one.centres - 0.5 * one.sides).min(axis=0), (one.centres + 0.5 * one.sides).max(axis=0)) for one in loaded
    ]
    extent = (block.length_mm, block.width_mm, block.height_mm)
    largest = COARSEST * max(extent)
    lines = []
    for axis in range(3):
        spans = [(low[axis], high[axis]) for low, high in boxes] if axis < 2 else [(0.0, 0.0)]  # noqa: PLR2004 - z
        finest = FINEST * min((float((high - low).max()) for low, high in boxes), default=largest / FINEST)
        size = partial(_view_size, spans=spans, finest=finest, largest=largest)
        start, end = (0.0, extent[axis]) if axis == 2 else (-0.5 * extent[axis], 0.5 * extent[axis])  # noqa: PLR2004
        lines.append(graded_line(start, end, size))
    return lines[0], lines[1], lines[2]


def _view_size(s: Floats, *, spans: list[tuple[float, float]], finest: float, largest: float) -> Floats:
    away = np.full_like(s, np.inf)
    for low, high in spans:
        away = np.minimum(away, np.maximum(np.maximum(low - s, s - high), 0.0))
    return np.minimum(finest + GROWTH * away, largest)


def _on_grid(basis: CellBasis, v: Floats) -> tuple[Lines, Floats]:
    """Return the lines through all nodes of 27-node cells of a box, and v on their crossings, shape (3, nx, ny, nz)."""
    corners = [np.unique(np.round(axis, 12)) for axis in basis.mesh.p]
    lines = [np.sort(np.concatenate([line, 0.5 * (line[1:] + line[:-1])])) for line in corners]
    values = np.empty((3, *(len(line) for line in lines)))
    for component in range(3):
        kinds = (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs)
        dofs = np.concatenate([kind[component] for kind in kinds])
        i, j, k = (_nearest(line, basis.doflocs[axis, dofs]) for axis, line in enumerate(lines))
        values[component, i, j, k] = v[dofs]
    return (lines[0], lines[1], lines[2]), values


def _nearest(line: Floats, places: Floats) -> Ints:
    right = np.clip(np.searchsorted(line, places), 1, len(line) - 1)
    return right - (places - line[right - 1] < line[right] - places)


def _interpolated(grid: tuple[Lines, Floats], lines: Lines) -> tuple[Floats, Floats]:
    """Return v (3, nx, ny, nz) and its gradient (3, 3, nx, ny, nz), derivative last, on the crossings of lines."""
    known, values = grid
    shapes = [_quadratic(one, other) for one, other in zip(known, lines, strict=True)]
    everywhere = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    found = [
        np.einsum("cijk,ai,bj,dk->cabd", values, shapes[0][a], shapes[1][b], shapes[2][c], optimize=True)
        for a, b, c in everywhere
    ]
    return found[0], np.stack(found[1:], axis=1)


def _quadratic(line: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Return values and derivatives at places of the quadratic shape functions on a line of corners and middles."""
    corners = line[::2]
    cell = np.clip(np.searchsorted(corners, places, side="right") - 1, 0, len(corners) - 2)
    width = corners[cell + 1] - corners[cell]
    t = (places - corners[cell]) / width
    value, rate = np.zeros((len(places), len(line))), np.zeros((len(places), len(line)))
    row = np.arange(len(places))
    shapes = ((1 - t) * (1 - 2 * t), 4 * t - 3), (4 * t * (1 - t), 4 - 8 * t), (t * (2 * t - 1), 4 * t - 1)
    for node, (shape, slope) in enumerate(shapes):
        value[row, 2 * cell + node] = shape
        rate[row, 2 * cell + node] = slope / width
    return value, rate


def _half_space(lines: Lines, tips: list[_Patches], points: list[_Patches]) -> halfspace.Potentials:
    """Return the sum of the potentials of all loads on the crossings of lines: patches near a tip, points beyond."""
    x, y, z = np.meshgrid(*lines, indexing="ij")
    total = np.zeros((len(fields(halfspace.Potentials)), *x.shape))
    total[0] = z
    for patches, nodes in zip(tips, points, strict=True):
        if not len(patches.forces):
            continue
        middle = nodes.centres.mean(axis=0)
        reach = NEAR * float(np.ptp(patches.centres, axis=0).max() + patches.sides.max())
        near = np.maximum(np.maximum(np.abs(x - middle[0]), np.abs(y - middle[1])), z) <= reach
        for chosen, loads in ((near, patches), (~near, nodes)):
            place = x[chosen], y[chosen], z[chosen]
            summed = np.zeros((len(total) - 1, len(place[0])))
            for centre, sides, force in zip(loads.centres, loads.sides, loads.forces, strict=True):
                summed += force * _unit_load((place[0] - centre[0], place[1] - centre[1], place[2]), sides)
            total[1:, chosen] += summed
    return halfspace.Potentials(*total)


def _unit_load(place: Lines, sides: Floats) -> Floats:
    """Return the potentials but for z of a unit force on a rectangle, or at a point where the sides are 0."""
    if sides[0] > 0.0:
        found = halfspace.rectangle_load(*place, (float(sides[0]), float(sides[1])))
        area = float(sides[0] * sides[1])
    else:
        found, area = halfspace.point_load(*place), 1.0
    return np.asarray(astuple(found)[1:], dtype=np.float64) / area


def _fields(lines: Lines, u: Floats, sigma: Floats) -> FruitFields:
    """Return the fields on a mesh with z up."""
    height = lines[2][-1]
    up = -lines[2][::-1]
    mesh = MeshHex.init_tensor(lines[0], lines[1], up).with_boundaries(
        {"top": lambda place: place[2] > -1e-9 * height, "base": lambda place: place[2] < (1e-9 - 1.0) * height}
    )
    flipped = u[..., ::-1] * np.array([1.0, 1.0, -1.0])[:, None, None, None]
    i, j, k = (_nearest(line, mesh.p[axis]) for axis, line in enumerate((lines[0], lines[1], up)))
    middles = mesh.p[:, mesh.t].mean(axis=1)
    a, b, c = (np.searchsorted(line, middles[axis]) - 1 for axis, line in enumerate((lines[0], lines[1], up)))
    return FruitFields(mesh=mesh, displacement=flipped[:, i, j, k].T, von_mises=von_mises(sigma)[..., ::-1][a, b, c])

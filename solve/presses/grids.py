"""Grids of cells with uniform pressure on an elastic half-space, one grid under each dome.

Within a grid, the compliance is Love's solution for a uniformly loaded rectangle, applied as a convolution (K. L.
Johnson, Contact Mechanics (1985), equation (3.25)). Between grids, it is Boussinesq's 1 / r, evaluated between the
Chebyshev nodes of the two grids. E* is E / (1 - nu^2).
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2

from sensor.arrays import Floats
from solve.presses.pressed_bodies import EllipsoidFruit, FleshOnStone, OuterLayer

Complexes = NDArray[np.complex128]

NODES = 8  # Chebyshev nodes per side; the error is 1e-5 for a contact of 2 mm radius at a distance of 5 mm


def love_transform(cells: int) -> Complexes:
    """Return the Fourier transform of Love's kernel: the deflection of cells under a unit pressure on one cell.

    Cells have unit size, and the deflection is multiplied by pi E*. Love's closed form is the sum, over the four
    corners of the loaded cell, of a arsinh(b / |a|) + b arsinh(a / |b|) with alternating signs. Here (a, b) is the
    position of the point relative to the corner. Offsets between cells run from -cells to cells - 1. A product of
    transforms therefore gives the convolution on a grid with `cells` cells per side, without wrap-around.
    """
    # Whole numbers in the order of a discrete Fourier transform: first 0 to cells - 1, then -cells to -1.
    offsets = np.fft.fftfreq(2 * cells, 1.0 / (2 * cells))
    x, y = np.meshgrid(offsets, offsets, indexing="ij")
    deflection = np.zeros_like(x)
    for sign_x, sign_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a = x + 0.5 * sign_x  # never 0, because offsets are whole numbers
        b = y + 0.5 * sign_y
        deflection += sign_x * sign_y * (a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b)))
    return rfft2(deflection)


def _lagrange_polynomials(nodes: Floats, points: Floats) -> Floats:
    """Return the Lagrange polynomials of some nodes (nodes,) at some points (points,), shape (nodes, points)."""
    polynomials = []
    for node in nodes:
        factors = [(points - other) / (node - other) for other in nodes if other != node]
        polynomials.append(np.prod(factors, axis=0))
    return np.array(polynomials)


class Grids:
    """One square grid of cells for each dome, and the deflection of all cells under forces on the cells.

    `centres` (tips, 2) [mm] are the centres of the grids, and `half_widths` (tips,) [mm] their half widths. `softness`
    (tips,) [1] is a factor on the compliance within each grid, and `constant` (tips,) [1/mm] is added to it. Arrays
    over cells have the shape (tips, cells, cells).
    """

    def __init__(
        self, centres: Floats, half_widths: Floats, cells: int, kernel: Complexes, fruit: EllipsoidFruit | None = None
    ) -> None:
        """Prepare the interpolation between cells and Chebyshev nodes, and the compliance between nodes of two grids.

        `centres` (tips, 2) [mm] and `half_widths` (tips,) [mm] describe the grids, each with `cells` cells per side.
        `kernel` is `love_transform(cells)`. `fruit` determines the local compliance under each dome, and may have a
        layer. Without `fruit`, the flesh is a homogeneous half-space.
        """
        self.centres = centres
        self.half_widths = half_widths
        self.cells = cells
        self.kernel = kernel
        self.cell_coordinates = (np.arange(cells) + 0.5) / cells * 2.0 - 1.0  # centres of the cells, from -1 to 1
        self.cell_size = 2.0 * half_widths / cells
        nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)  # Chebyshev nodes, from -1 to 1
        self.node_polynomials = _lagrange_polynomials(nodes, self.cell_coordinates)  # (nodes, cells)
        distance = self._node_distances(nodes)
        self.node_compliance = 1.0 / distance  # times pi E* [1/mm]; 0 within a grid, where the distance is infinite
        if fruit is None:
            fruit = EllipsoidFruit(E=1.0, R1=math.inf, R2=math.inf)  # a half-space; results do not depend on its E
        # The local compliance under each dome: a factor on the kernel, and a constant added to the deflection.
        factor, constant = fruit.local_compliance
        self.softness = np.broadcast_to(factor, len(centres))
        self.constant = np.broadcast_to(constant, len(centres))
        self.layer_kernel: Complexes | None = None
        if fruit.layer is not None:
            self._add_layer(fruit.layer, distance)

    def _add_layer(self, layer: OuterLayer | FleshOnStone, distance: Floats) -> None:
        """Include a layer in the compliances within and between grids, by changing the attributes that hold them.

        The compliance of a layer is the compliance of its material plus the effect of the base. `distance` [mm] holds
        the distances between nodes, as `_node_distances` returns them.
        """
        # Within a grid, the effect of the base is smooth, so it is evaluated at the distances between cell centres. The
        # offsets have the order of a discrete Fourier transform.
        offsets = np.fft.fftfreq(2 * self.cells, 1.0 / (2 * self.cells))
        cell_distances = self.cell_size[:, None, None] * np.hypot(offsets[:, None], offsets)
        self.layer_kernel = rfft2(layer.base_effect(cell_distances))
        self.softness = self.softness / layer.stiffness
        is_between_grids = np.isfinite(distance)
        self.node_compliance = self.node_compliance / layer.stiffness
        self.node_compliance[is_between_grids] += layer.base_effect(distance[is_between_grids])

    def _node_distances(self, nodes: Floats) -> Floats:
        """Return the distances between all nodes of all grids [mm], shape (tips, tips, NODES^2, NODES^2).

        `nodes` are the coordinates of the nodes along a grid, from -1 to 1. Distances within a grid are set to
        infinity, because the convolution already gives the deflection there.
        """
        square = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1)  # nodes of a grid, (NODES, NODES, 2)
        positions = self.centres[:, None, None] + self.half_widths[:, None, None, None] * square
        positions = positions.reshape(len(self.centres), -1, 2)
        distance = np.linalg.norm(positions[:, None, :, None] - positions[None, :, None, :], axis=-1)
        distance[range(len(positions)), range(len(positions))] = np.inf
        return np.asarray(distance)

    def positions(self) -> tuple[Floats, Floats]:
        """Return the coordinates x and y of the centres of all cells [mm], each (tips, cells, cells)."""
        x = self.centres[:, 0, None] + self.half_widths[:, None] * self.cell_coordinates
        y = self.centres[:, 1, None] + self.half_widths[:, None] * self.cell_coordinates
        shape = (len(x), self.cells, self.cells)
        return np.broadcast_to(x[:, :, None], shape), np.broadcast_to(y[:, None, :], shape)

    def transfer(self, centres: Floats, half_widths: Floats, forces: Floats) -> Floats:
        """Transfer the pressure on these grids to new grids, and return the forces on the cells of the new grids [N].

        Each new cell takes the pressure of the old cell in which its centre lies, or 0 outside the old grid. `forces`
        (tips, cells, cells) [N] act on the cells of these grids. The new grids have the centres `centres` (tips, 2)
        [mm] and the half widths `half_widths` (tips,) [mm].
        """
        transferred: Floats = np.zeros_like(forces)
        for tip in range(len(forces)):
            offset = (centres - self.centres)[tip, :, None]
            # Find the row and column of the old cell that contains the centre of each new cell. Along x and y,
            # `from_edge` (2, cells) [mm] is the distance of the new cells from the edge of the old grid.
            from_edge = self.cell_coordinates * half_widths[tip] + offset + self.half_widths[tip]
            row, column = np.floor(from_edge / self.cell_size[tip]).astype(int)
            row_is_inside = (row >= 0) & (row < self.cells)
            column_is_inside = (column >= 0) & (column < self.cells)
            old_forces = forces[tip][np.ix_(row.clip(0, self.cells - 1), column.clip(0, self.cells - 1))]
            # At the same pressure, the force on a cell is proportional to its area.
            area_ratio = (half_widths[tip] / self.half_widths[tip]) ** 2
            transferred[tip] = old_forces * np.outer(row_is_inside, column_is_inside) * area_ratio
        return transferred

    def precondition(self, deflections: Floats) -> Floats:
        """Return approximate forces on the cells for given deflections, up to a common factor.

        The convolution of each grid is inverted, and the interaction between grids is neglected. The result
        preconditions the conjugate gradients of a contact, for which a rough inverse is sufficient.
        """
        padded = (2 * self.cells, 2 * self.cells)
        # Love's kernel is even, so its transform is real up to round-off.
        forces = irfft2(rfft2(deflections, padded) / self.kernel.real, padded)[:, : self.cells, : self.cells]
        scaled: Floats = forces * (self.cell_size / self.softness)[:, None, None]
        return scaled

    def deflection(self, forces: Floats) -> Floats:
        """Return pi E* times the deflection of all cells [N/mm] under forces on the cells [N].

        Both arrays are (tips, cells, cells). The deflection due to the forces on the same grid is a convolution, which
        is computed on a grid padded to twice the size to avoid wrap-around. The forces on other grids are collected at
        their Chebyshev nodes. The resulting deflection of the nodes of this grid is interpolated to its cells.
        """
        padded = (2 * self.cells, 2 * self.cells)
        force_transform = rfft2(forces, padded)
        own_transform = force_transform * self.kernel * (self.softness / self.cell_size)[:, None, None]
        if self.layer_kernel is not None:
            own_transform = own_transform + force_transform * self.layer_kernel
        from_own_grid: Floats = irfft2(own_transform, padded)[:, : self.cells, : self.cells]
        # The constant part of the local compliance deflects all cells of a grid equally.
        from_own_grid = from_own_grid + self.constant[:, None, None] * forces.sum(axis=(1, 2), keepdims=True)
        node_forces = self.node_polynomials @ forces @ self.node_polynomials.T
        # Node a of grid t is deflected by the force at node b of each other grid s.
        node_deflections = np.einsum("tsab,sb->ta", self.node_compliance, node_forces.reshape(len(forces), -1))
        node_deflections = node_deflections.reshape(-1, NODES, NODES)
        from_other_grids: Floats = self.node_polynomials.T @ node_deflections @ self.node_polynomials
        return from_own_grid + from_other_grids

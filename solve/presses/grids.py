"""Grids of cells of uniform pressure on an elastic half-space, one under each dome.

Within a grid the compliance is Love's rectangle (K. L. Johnson, Contact Mechanics (1985), equation (3.25)), applied as
a convolution. Between grids it is Boussinesq's 1 / r, interpolated between Chebyshev nodes of both grids.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2

from sensor.arrays import Floats
from solve.presses.pressed_bodies import EllipsoidFruit

Complexes = NDArray[np.complex128]

NODES = 8  # Chebyshev nodes per side; for a contact of 2 mm radius at 5 mm distance the error is 1e-5


def love(cells: int) -> Complexes:
    """Return the Fourier transform of the deflections of unit cells by a unit pressure on one cell, times pi E*.

    The deflection is Love's closed form, a sum over the four corners of the loaded cell. Distances run from -cells to
    cells, so that a product of transforms is the convolution on a grid of `cells` per side.
    """
    i = np.fft.fftfreq(2 * cells, 1.0 / (2 * cells))
    x, y = np.meshgrid(i, i, indexing="ij")
    total = np.zeros_like(x)
    for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a, b = x + 0.5 * sx, y + 0.5 * sy  # never 0, as cells lie at whole numbers
        total += sx * sy * (a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b)))
    return rfft2(total)


class Grids:
    """Grids of cells about `middles` (tips, 2) with half widths `reach` (tips,) [mm], and their deflections."""

    def __init__(
        self, middles: Floats, reach: Floats, cells: int, kernel: Complexes, fruit: EllipsoidFruit | None = None
    ) -> None:
        """Prepare the interaction of the grids: polynomials through Chebyshev nodes, and 1 / r between nodes.

        `fruit` gives the local compliance under each dome, and a layer. Without it the flesh is an even half-space.
        """
        self.middles, self.reach, self.cells, self.kernel = middles, reach, cells, kernel
        self.steps = (np.arange(cells) + 0.5) / cells * 2.0 - 1.0  # coordinates of cells along a grid, from -1 to 1
        self.size = 2.0 * reach / cells
        nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
        polynomials = []
        for n in nodes:
            polynomials.append(np.prod([(self.steps - m) / (n - m) for m in nodes if m != n], axis=0))
        self.between = np.array(polynomials)
        square = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1)
        places = middles[:, None, None] + reach[:, None, None, None] * square
        flat = places.reshape(len(middles), -1, 2)
        distance = np.linalg.norm(flat[:, None, :, None] - flat[None, :, None, :], axis=-1)
        distance[range(len(middles)), range(len(middles))] = np.inf  # a grid acts on itself by its convolution
        self.cross = 1.0 / distance
        fruit = fruit or EllipsoidFruit(E=1.0, R1=math.inf, R2=math.inf)
        self.softness, self.constant = (np.broadcast_to(of_tips, len(middles)) for of_tips in fruit.own)
        self.rest: Complexes | None = None
        if fruit.layer is not None:
            steps = np.fft.fftfreq(2 * cells, 1.0 / (2 * cells))
            distances = self.size[:, None, None] * np.hypot(steps[:, None], steps)
            self.rest = rfft2(fruit.layer.rest(distances))
            self.softness = self.softness / fruit.layer.stiffness
            beside = np.isfinite(distance)
            self.cross = self.cross / fruit.layer.stiffness
            self.cross[beside] += fruit.layer.rest(distance[beside])

    def places(self) -> tuple[Floats, Floats]:
        """Return x and y of all cells [mm], each (tips, cells, cells)."""
        x = self.middles[:, 0, None] + self.reach[:, None] * self.steps
        y = self.middles[:, 1, None] + self.reach[:, None] * self.steps
        shape = (len(x), self.cells, self.cells)
        return np.broadcast_to(x[:, :, None], shape), np.broadcast_to(y[:, None, :], shape)

    def moved_to(self, middles: Floats, reach: Floats, forces: Floats) -> Floats:
        """Return forces [N] of the cells of other grids that press approximately like these, by nearest cells."""
        moved: Floats = np.zeros_like(forces)
        for tip in range(len(forces)):
            offset = (middles - self.middles)[tip, :, None]
            place = (self.steps * reach[tip] + offset + self.reach[tip]) / self.size[tip]
            row, column = np.floor(place).astype(int)
            inside = [(index >= 0) & (index < self.cells) for index in (row, column)]
            found = forces[tip][np.ix_(row.clip(0, self.cells - 1), column.clip(0, self.cells - 1))]
            moved[tip] = found * np.outer(*inside) * (reach[tip] / self.reach[tip]) ** 2
        return moved

    def stiffened(self, deflections: Floats) -> Floats:
        """Return approximate forces of cells for deflections in each grid separately, up to a common factor."""
        twice = (2 * self.cells, 2 * self.cells)
        forces = irfft2(rfft2(deflections, twice) / self.kernel.real, twice)[:, : self.cells, : self.cells]
        stiffened: Floats = forces * (self.size / self.softness)[:, None, None]
        return stiffened

    def deflection(self, forces: Floats) -> Floats:
        """Return pi E* times the deflection [N/mm] under forces of cells [N], both (tips, cells, cells).

        Within a grid it is a convolution, in a square of twice the size so that it does not wrap around. Between grids
        the forces are moved to Chebyshev nodes, act by 1 / r there, and the deflection is interpolated from nodes to
        cells.
        """
        twice = (2 * self.cells, 2 * self.cells)
        waves = rfft2(forces, twice)
        own_waves = waves * self.kernel * (self.softness / self.size)[:, None, None]
        if self.rest is not None:
            own_waves = own_waves + waves * self.rest
        own: Floats = irfft2(own_waves, twice)[:, : self.cells, : self.cells]
        own = own + self.constant[:, None, None] * forces.sum(axis=(1, 2), keepdims=True)
        at_nodes = self.between @ forces @ self.between.T
        felt = np.einsum("tsab,sb->ta", self.cross, at_nodes.reshape(len(forces), -1))
        others: Floats = self.between.T @ felt.reshape(-1, NODES, NODES) @ self.between
        return own + others

"""Presses of a sensor of sprung domes on an ellipsoidal fruit, by boundary elements.

Nothing of the product's laws of contact is in them.

Under every dome lies its own square grid of cells of uniform pressure on an elastic half-space. Within a grid the
compliance is Love's rectangle (K. L. Johnson, Contact Mechanics (1985), equation (3.25)), applied as a convolution.
Between grids it is Boussinesq's 1 / r, interpolated between Chebyshev nodes of both grids.
The gaps are those of true spheres over the skin z = -(k_xx x^2 + 2 k_xy x y + k_yy y^2) / 2.
Forces and displacements are along the axis of the sensor: slopes are small, contact is unilateral and frictionless.

**What is no even ellipsoid.** A height map is added to the skin, a form to the domes. A layer bonded on the flesh is
exact: Burmister's transform of its compliance replaces 1 / r. Flesh may be softer under one dome, in a hemisphere. Then
that dome's own compliance is the softer flesh's, less `BRUISE` / radius for what lies outside. Between domes the flesh
outside counts. The contact is taken for small beside the hemisphere. Flesh that yields carries at most its pressure.

**Flesh that relaxes** in contacts that grow follows from elastic flesh: E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27
(1960) 438. Elastic forces n make the indentations, and the forces are n - sum g_i m_i, tau_i dm_i/dt = n - m_i.

The cells in contact are found by an active set. Cells that would pull leave it, and cells that would enter join it. A
step is shortened until it lowers the energy. The forces of a set are those of conjugate gradients, preconditioned by
the inverse of each grid's convolution. Every grid follows its contact from sample to sample, so the error of
discretisation is nearly one factor of all forces. Lengths in mm, forces in N, moduli in MPa.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.interpolate import CubicSpline
from scipy.special import j0

from sensor.arrays import Flags, Floats

Complexes = NDArray[np.complex128]
Slope = tuple[float, float] | Floats

CELLS = 32
NODES = 8  # of a grid, each way: from a neighbour 5 mm away a contact of 2 mm radius looks smooth to 1e-5
MOST_STEPS = 400
MOST_SETS = 100
LEAST_PART = 1e-3  # of a step to the forces of an active set
SETTLED = 1e-7  # of the deepest interference
FILLED = (0.72, 0.94)  # of a grid, how wide a contact may be
SOUGHT = 3.0  # [mm] from a dome's touch on the ellipsoid to that on its height map, at most
BRUISE = (1.52, 2.3)
"""The deflection of a point by flesh outside a hemisphere about it, times its radius over pi E*: its value at a
Poisson's ratio of 0.3, and the slope. By finite elements, within 3 % (`tests/reference`)."""


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Domes of a radius [mm] at `positions` (tips, 2) [mm], each on its own spring `K` (tips,) [N/mm].

    `form` is by how much all domes stand out of their spheres [mm] at distances [mm] from their axes.
    """

    dome_radius: float
    positions: np.ndarray
    K: np.ndarray
    form: Callable[[Floats], Floats] | None = None


@dataclass(frozen=True)
class Layer:
    """Flesh of a `thickness` [mm], above the size of cells, `stiffness` [1] times as stiff as that bonded below it.

    D. M. Burmister, J. Appl. Phys. 16 (1945) 89; T. C. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235.
    """

    thickness: float
    stiffness: float
    poisson: float = 0.3

    def compliance(self, t: Floats) -> Floats:
        """Return the compliance at wave numbers times the thickness, over that of the layer's flesh alone [1]."""
        k = 3.0 - 4.0 * self.poisson
        upper = (self.stiffness - 1.0) / (self.stiffness + k)
        lower = k * (self.stiffness - 1.0) / (1.0 + self.stiffness * k)
        once, twice = np.exp(-2.0 * t), np.exp(-4.0 * t)
        above = 1.0 + 4.0 * t * upper * once - lower * upper * twice
        return above / (1.0 - (lower + upper + 4.0 * upper * t**2) * once + lower * upper * twice)

    @cached_property
    def rest(self) -> CubicSpline:
        """Return pi E* of the flesh below times the deflection by a unit force, less 1 / (stiffness r) [1/mm], by r."""
        t = np.linspace(0.0, 15.0, 3001)
        r = self.thickness * np.concatenate([np.linspace(0.0, 4.0, 81), np.geomspace(4.0, 40.0, 60)[1:]])
        waves = (self.compliance(t) - 1.0) * j0(t * r[:, None] / self.thickness)
        return CubicSpline(r, np.asarray(np.trapezoid(waves, t, axis=-1)) / (self.stiffness * self.thickness))


def square(side: float = 6.0, K_low: float = 0.15, K_high: float = 1.4, dome_radius: float = 10.0) -> Sensor:
    """Return a square of a side [mm], low and high springs [N/mm] in turn round it."""
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Sensor(dome_radius=dome_radius, positions=corners, K=np.array([K_low, K_high, K_low, K_high]))


@dataclass(frozen=True, kw_only=True)
class Fruit:
    """A modulus [MPa], two principal radii [mm], the direction of the first from +x, and how the sensor stands on it.

    The side of the sensor at `tilt_azimuth` is lower by a `tilt` [deg]; the apex lies at `apex` [mm]. `heights` (tips,)
    [mm] is by how much each dome stands out before its place. `bumps` are heights added to the skin [mm] at x, y [mm].

    `softness` (tips,) is the modulus of the fruit over that of the flesh under each dome, within a hemisphere of
    `soft_radius` (tips,) [mm]. Flesh yields at a pressure `yields` [MPa].
    """

    E: float
    R1: float
    R2: float
    azimuth: float = 0.0
    tilt: float = 0.0
    tilt_azimuth: float = 0.0
    apex: tuple[float, float] = (0.0, 0.0)
    poisson: float = 0.3
    heights: tuple[float, ...] = field(default=(0.0,))
    bumps: Callable[[Floats, Floats], Floats] | None = None
    softness: tuple[float, ...] = (1.0,)
    soft_radius: tuple[float, ...] = (math.inf,)
    layer: Layer | None = None
    yields: float = math.inf

    @property
    def own(self) -> Floats:
        """Return the local compliance under each dome over that of the flesh, and what is constant beside it [1/mm]."""
        softness, radius = np.broadcast_arrays(self.softness, self.soft_radius)
        outside = BRUISE[0] + BRUISE[1] * (self.poisson - 0.3)
        return np.stack([softness, (1.0 - softness) * outside / radius])

    @property
    def curvature(self) -> Floats:
        """Return the tensor of curvatures [1/mm], (2, 2)."""
        angle = math.radians(self.azimuth)
        along = np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-along[1], along[0]])
        return np.outer(along, along) / self.R1 + np.outer(across, across) / self.R2

    @property
    def slope(self) -> Floats:
        """Return by how much the skin rises along x and y in the frame of the sensor [1]."""
        angle = math.radians(self.tilt_azimuth)
        return math.tan(math.radians(self.tilt)) * np.array([math.cos(angle), math.sin(angle)])

    @property
    def compliance(self) -> float:
        """Return the deflection times distance that a unit point load makes [mm^2/N]."""
        return (1.0 - self.poisson**2) / (math.pi * self.E)


def random_fruits(count: int, seed: int) -> Iterator[Fruit]:
    """Yield random fruits of the new mango: any azimuth, tilts up to 4 degrees evenly over all slopes."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield Fruit(
            E=math.exp(rng.uniform(math.log(0.5), math.log(3.5))),
            R1=rng.uniform(42.0, 53.0),
            R2=rng.uniform(86.0, 144.0),
            azimuth=rng.uniform(-90.0, 90.0),
            tilt=4.0 * math.sqrt(rng.uniform()),
            tilt_azimuth=rng.uniform(0.0, 360.0),
        )


def love(cells: int) -> Complexes:
    """Return the transform of the deflections of cells of side 1 by a unit pressure on one cell, times pi E*.

    Distances run from -cells to cells, so that a product of transforms is the convolution on a grid of `cells` a side.
    """
    i = np.fft.fftfreq(2 * cells, 1.0 / (2 * cells))
    x, y = np.meshgrid(i, i, indexing="ij")
    total = np.zeros_like(x)
    for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        a, b = x + 0.5 * sx, y + 0.5 * sy
        r = np.hypot(a, b)
        total += sx * sy * (a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b)))
        assert r.min() > 0.0
    return rfft2(total)


class Grids:
    """Grids of cells about `middles` (tips, 2), half as wide as `reach` (tips,) [mm], and what their forces do."""

    def __init__(
        self, middles: Floats, reach: Floats, cells: int, kernel: Complexes, fruit: Fruit | None = None
    ) -> None:
        """Set up the polynomials through Chebyshev's nodes, and 1 / r between the nodes of different grids."""
        self.middles, self.reach, self.cells, self.kernel = middles, reach, cells, kernel
        self.steps = (np.arange(cells) + 0.5) / cells * 2.0 - 1.0  # places of cells along a grid, from -1 to 1
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
        distance[range(len(middles)), range(len(middles))] = np.inf
        self.cross = 1.0 / distance
        fruit = fruit or Fruit(E=1.0, R1=math.inf, R2=math.inf)
        self.softness, self.constant = (np.broadcast_to(of_tips, len(middles)) for of_tips in fruit.own)
        self.rest: Complexes | None = None
        if fruit.layer is not None:
            steps = np.fft.fftfreq(2 * cells, 1.0 / (2 * cells))
            apart = self.size[:, None, None] * np.hypot(steps[:, None], steps)
            self.rest = rfft2(fruit.layer.rest(apart))
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
        """Return the forces [N] of cells of other grids that press nearly as these do, each by the cell it lies in."""
        moved = np.zeros_like(forces)
        for tip in range(len(forces)):
            offset = (middles - self.middles)[tip, :, None]
            place = (self.steps * reach[tip] + offset + self.reach[tip]) / self.size[tip]
            row, column = np.floor(place).astype(int)
            inside = [(index >= 0) & (index < self.cells) for index in (row, column)]
            found = forces[tip][np.ix_(row.clip(0, self.cells - 1), column.clip(0, self.cells - 1))]
            moved[tip] = found * np.outer(*inside) * (reach[tip] / self.reach[tip]) ** 2
        return moved

    def stiffened(self, deflections: Floats) -> Floats:
        """Return the forces of cells that make deflections in each grid alone, nearly and but for one factor of all."""
        twice = (2 * self.cells, 2 * self.cells)
        forces = irfft2(rfft2(deflections, twice) / self.kernel.real, twice)[:, : self.cells, : self.cells]
        return forces * (self.size / self.softness)[:, None, None]

    def deflection(self, forces: Floats) -> Floats:
        """Return pi E* times the deflection [N/mm] under forces of cells [N], (tips, cells, cells)."""
        twice = (2 * self.cells, 2 * self.cells)
        waves = rfft2(forces, twice)
        own_waves = waves * self.kernel * (self.softness / self.size)[:, None, None]
        if self.rest is not None:
            own_waves = own_waves + waves * self.rest
        own = irfft2(own_waves, twice)[:, : self.cells, : self.cells]
        own = own + self.constant[:, None, None] * forces.sum(axis=(1, 2), keepdims=True)
        at_nodes = np.einsum("ai,tij,bj->tab", self.between, forces, self.between, optimize=True)
        felt = np.einsum("tsab,sb->ta", self.cross, at_nodes.reshape(len(forces), -1))
        felt = felt.reshape(-1, NODES, NODES)
        others = np.einsum("ai,tab,bj->tij", self.between, felt, self.between, optimize=True)
        return own + others


class Pressing:
    """A sensor on a fruit, pressed farther and farther."""

    def __init__(self, sensor: Sensor, fruit: Fruit, cells: int = CELLS) -> None:
        """Find where each dome first touches, by Newton's method, then on the height map by search."""
        self.sensor, self.fruit, self.cells = sensor, fruit, cells
        self.kernel = love(cells)
        self.touch = sensor.positions.copy()
        for _ in range(20):
            step = np.array([np.linalg.solve(*self._slopes(tip)) for tip in range(len(self.touch))])
            self.touch = self.touch - step
        if fruit.bumps is not None or sensor.form is not None:
            for half in (SOUGHT, SOUGHT / 40.0, SOUGHT / 1600.0):
                self.touch = self._lowest(half)
        self.give = 1.0 / sensor.K
        self.recovered = np.zeros(len(self.touch))  # of the springs, what the flesh has lost of its forces [mm]
        self.filled = np.full(len(self.touch), FILLED[0])
        self.nearest = self.gap(self.touch[:, 0, None, None], self.touch[:, 1, None, None])[:, 0, 0]
        bend = np.linalg.eigvalsh(fruit.curvature)[0]
        self.widest = 1.0 / (1.0 / sensor.dome_radius + bend)  # radius of relative curvature [mm]
        self.grids: Grids | None = None
        self.cell_forces = np.zeros((len(self.touch), cells, cells))

    def _slopes(self, tip: int) -> tuple[Floats, Floats]:
        """Return the second and the first derivatives of the gap where the dome is taken to touch."""
        r = self.sensor.dome_radius
        away = self.touch[tip] - self.sensor.positions[tip]
        fall = math.sqrt(r**2 - away @ away)
        own = np.eye(2) / fall + np.outer(away, away) / fall**3
        beside = self.touch[tip] - self.fruit.apex
        return own + self.fruit.curvature, away / fall + self.fruit.curvature @ beside - self.fruit.slope

    def _lowest(self, half: float) -> Floats:
        """Return where the gap under each dome is least, in squares of a half side [mm] about the touches."""
        steps = np.linspace(-half, half, 161)
        x = self.touch[:, 0, None, None] + steps[:, None]
        y = self.touch[:, 1, None, None] + steps
        x, y = np.broadcast_arrays(x, y)
        least = self.gap(x, y).reshape(len(x), -1).argmin(axis=1)
        rows = np.arange(len(x))
        return np.stack([x.reshape(len(x), -1)[rows, least], y.reshape(len(x), -1)[rows, least]], axis=-1)

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Return the gaps between the domes and the skin [mm], (tips, ...), where the sensor stands at height 0."""
        r = self.sensor.dome_radius
        dx = x - self.sensor.positions[:, 0, None, None]
        dy = y - self.sensor.positions[:, 1, None, None]
        dome = r - np.sqrt(np.maximum(r**2 - dx**2 - dy**2, 0.0))
        if self.sensor.form is not None:
            dome = dome - self.sensor.form(np.hypot(dx, dy))
        k = self.fruit.curvature
        x0, y0 = self.fruit.apex
        skin = 0.5 * (k[0, 0] * (x - x0) ** 2 + 2.0 * k[0, 1] * (x - x0) * (y - y0) + k[1, 1] * (y - y0) ** 2)
        if self.fruit.bumps is not None:
            skin = skin - self.fruit.bumps(x, y)
        out = np.broadcast_to(self.fruit.heights, len(dx))[:, None, None]
        return dome + skin - self.fruit.slope[0] * x - self.fruit.slope[1] * y - out

    def forces(self, travel: float, changed_slope: Slope = (0.0, 0.0)) -> Floats:
        """Return the forces of the domes [N] at a travel [mm] from the first touch, (tips,).

        Grids are laid anew until each fits its contact. Raises ArithmeticError where they do not come to fit.
        """
        lowered = travel + self.nearest.min() + self.sensor.positions @ np.array(changed_slope) + self.recovered
        entered = lowered - self.nearest
        reach = np.sqrt(2.0 * self.widest * np.maximum(entered, 1e-4)) if self.grids is None else self.grids.reach
        middles = self.touch if self.grids is None else self.grids.middles
        start = None if self.grids is None else self.cell_forces
        for _ in range(12):
            grids = Grids(middles, reach, self.cells, self.kernel, self.fruit)
            found = self._yielded(grids, lowered, start)
            total = found.sum(axis=(1, 2))
            middles, reach, fits = self._fitted(grids, found, entered)
            if fits and self.fruit.bumps is not None:
                missed = self._missed(grids, total, lowered)
                self.filled[missed] *= 0.8
                reach = np.where(missed, reach / 0.8, reach)
                fits = not missed.any()
            if fits:
                break
            start = grids.moved_to(middles, reach, found)
        else:
            raise ArithmeticError(travel)
        self.grids, self.cell_forces = grids, found
        self.area = (found > 0.0).sum(axis=(1, 2)) * grids.size**2
        return total

    def _fitted(self, grids: Grids, found: Floats, entered: Floats) -> tuple[Floats, Floats, bool]:
        """Return middles and reaches of grids that fit the contacts, and whether the given grids do.

        `found` are the forces of the cells, `entered` (tips,) how far the undeformed domes enter the fruit.
        """
        middles, reach = grids.middles.copy(), grids.reach.copy()
        fits = True
        for tip, forces in enumerate(found):
            rows, columns = np.flatnonzero(forces.any(axis=1)), np.flatnonzero(forces.any(axis=0))
            if not len(rows):  # off the fruit: a small grid waits where the dome will touch
                reach[tip] = 1.2 * math.sqrt(self.widest * max(0.02 * abs(entered[tip]), 1e-3))
                middles[tip] = self.touch[tip]
                continue
            first = np.array([rows[0], columns[0]])
            last = np.array([rows[-1], columns[-1]])
            width = (last - first + 1).max() / grids.cells
            edge = first.min() == 0 or last.max() == grids.cells - 1
            if edge or not self.filled[tip] <= width <= FILLED[1]:
                fits = False
                middles[tip] = grids.middles[tip] + 0.5 * (first + last + 1 - grids.cells) * grids.size[tip]
                reach[tip] = grids.reach[tip] * (1.5 if edge and width > 0.9 else max(width, 2.5 / grids.cells) / 0.83)
        return middles, reach, fits

    def _missed(self, grids: Grids, total: Floats, lowered: Floats) -> Flags:
        """Return under which domes the height map would touch outside the grid, (tips,)."""
        steps = np.linspace(-2.0, 2.0, 81)
        outside = np.maximum(np.abs(steps[:, None]), np.abs(steps)) > 1.0
        x = grids.middles[:, 0, None, None] + grids.reach[:, None, None] * steps[:, None]
        y = grids.middles[:, 1, None, None] + grids.reach[:, None, None] * steps
        x, y = np.broadcast_arrays(x, y)
        distance = np.hypot(
            x[:, None] - grids.middles[:, 0, None, None], y[:, None] - grids.middles[:, 1, None, None]
        ).clip(1e-3)
        sunk = self.fruit.compliance * (total[:, None, None] / distance).sum(axis=1)
        left = lowered - self.give * total
        return (outside & (left[:, None, None] - self.gap(x, y) > sunk)).any(axis=(1, 2))

    def _yielded(self, grids: Grids, lowered: Floats, start: Floats | None) -> Floats:
        """Return the forces of all cells [N], none above that at which the flesh yields."""
        x, y = grids.places()
        wanted = lowered[:, None, None] - self.gap(x, y)
        largest = np.broadcast_to(self.fruit.yields * (grids.size**2)[:, None, None], wanted.shape)
        yielded = np.zeros_like(wanted, dtype=bool)
        for _ in range(MOST_SETS):
            carried = np.where(yielded, largest, 0.0)
            felt = self._sunk(grids, carried) if yielded.any() else 0.0
            begin = None if start is None else np.where(yielded, 0.0, start)
            found = self._pressed(grids, wanted - felt, begin, ~yielded) + carried
            if math.isinf(self.fruit.yields):
                return found
            still = yielded & (self._sunk(grids, found) <= wanted)
            after = still | (found > largest * (1.0 + 1e-9))
            if (after == yielded).all():
                return found
            yielded, start = after, found
        raise ArithmeticError(self.fruit.yields)

    def _sunk(self, grids: Grids, forces: Floats) -> Floats:
        """Return deflection of the fruit and of the springs under forces of cells [mm]."""
        springs = self.give[:, None, None] * forces.sum(axis=(1, 2), keepdims=True)
        return self.fruit.compliance * grids.deflection(forces) + springs

    def _pressed(self, grids: Grids, wanted: Floats, start: Floats | None, free: Flags) -> Floats:
        """Return the forces of the free cells [N] of least energy, by an active set from those of a start.

        `wanted` [mm] is how far each cell is to sink if it touches.
        """

        def sunk(forces: Floats) -> Floats:
            """Return deflection under forces of cells [mm]."""
            return self._sunk(grids, forces)

        allowed = SETTLED * max(wanted.max(), 1e-6)
        slack = (allowed * grids.size / self.fruit.compliance)[:, None, None]  # would sink a cell by some `allowed`
        active = free & (wanted > 0.0 if start is None else start > 0.0)
        f = np.zeros_like(wanted) if start is None else start
        energy = 0.5 * (f * (sunk(f) - 2.0 * wanted)).sum()
        system = _System(grids, sunk, wanted, 0.5 * allowed)
        for _ in range(MOST_SETS):
            solved, apart = system.balanced(np.where(active, f, 0.0), active)
            pulls = (solved < -slack).any()
            # Where cells would pull, the step is shortened until it lowers the energy.
            before, f, part = f, solved, 1.0
            while pulls and part > LEAST_PART:
                f = np.maximum(before + part * (solved - before), 0.0)
                apart = sunk(f) - wanted
                part *= 0.5
                if 0.5 * (f * (apart - wanted)).sum() < energy:
                    break
            energy = 0.5 * (f * (apart - wanted)).sum()
            enters = free & (f == 0.0) & (apart < -allowed)
            if not pulls and not enters.any():
                return np.maximum(f, 0.0)
            active = (f > 0.0) | enters
        raise ArithmeticError(allowed)


@dataclass(frozen=True)
class _System:
    """Cells that are to sink as `wanted`, within what is `allowed` [mm], and how they sink under forces, `sunk`."""

    grids: Grids
    sunk: Callable[[Floats], Floats]
    wanted: Floats
    allowed: float

    def balanced(self, f: Floats, active: Flags) -> tuple[Floats, Floats]:
        """Return forces of the active cells [N] that sink them as wanted, from others f, and the gaps of all cells.

        By conjugate gradients, preconditioned by the inverse of each grid's convolution.
        """
        apart = self.sunk(f) - self.wanted
        way, before = np.zeros_like(f), 1.0
        for step in range(MOST_STEPS):
            left = np.where(active, apart, 0.0)
            if np.abs(left).max() < self.allowed:
                return f, apart
            smooth = np.where(active, self.grids.stiffened(left), 0.0)
            product = (left * smooth).sum()
            way = -smooth + (product / before if step else 0.0) * way
            before = product
            answer = self.sunk(way)
            length = product / (answer * way).sum()
            f = f + length * way
            apart = apart + length * answer
        raise ArithmeticError(np.abs(left).max() / self.allowed)


def press(
    sensor: Sensor, fruit: Fruit, travels: Sequence[float] | Floats, cells: int = CELLS, drift: Slope = (0.0, 0.0)
) -> Floats:
    """Return the forces of the domes at travels [mm] from the first touch, (samples, tips) [N].

    The slope of the sensor grows by `drift` [1] along x and y from the first travel to the last.
    """
    pressing = Pressing(sensor, fruit, cells)
    last = max(travels)
    return np.array([pressing.forces(x, np.multiply(drift, x / last)) for x in travels])


def press_over_time(
    sensor: Sensor,
    fruit: Fruit,
    travels: Sequence[float] | Floats,
    times: Sequence[float] | Floats,
    arms: Sequence[tuple[float, float]],
    cells: int = CELLS,
) -> Floats:
    """Return the forces of the domes on flesh that relaxes, at travels [mm] and times [s], (samples, tips) [N].

    `arms` are shares g_i [1] and times tau_i [s]. Elastic forces run straight from sample to sample. Raises
    ArithmeticError if they fall: contacts that shrink have no such forces.
    """
    pressing = Pressing(sensor, fruit, cells)
    shares, taus = np.array(arms).T
    kept = np.zeros((len(taus), len(sensor.K)))  # m_i
    elastic = np.zeros(len(sensor.K))
    found = []
    for travel, step in zip(travels, np.diff(times, prepend=times[0]), strict=True):
        decay = np.exp(-step / taus)
        mean = np.where(step > 0.0, (1.0 - decay) / np.maximum(step / taus, 1e-12), 1.0)  # of the decay over the step
        from_before = decay[:, None] * kept + (mean - decay)[:, None] * elastic
        fresh, lost = 1.0 - shares @ (1.0 - mean), shares @ from_before
        pressing.give, pressing.recovered = fresh / sensor.K, lost / sensor.K
        before, elastic = elastic, pressing.forces(travel)
        if (elastic < before * (1.0 - 1e-3)).any():
            raise ArithmeticError(travel)
        kept = from_before + (1.0 - mean)[:, None] * elastic
        found.append(np.maximum(fresh * elastic - lost, 0.0))
    return np.array(found)


def hertz_error(cells: int) -> Floats:
    """Return by how much a single rigid dome on a flat fruit is stiffer here than in Hertz's formula [1]."""
    alone = Sensor(dome_radius=1000.0, positions=np.zeros((1, 2)), K=np.array([1e9]))
    fruit = Fruit(E=1.0, R1=1e9, R2=1e9)
    depths = np.geomspace(1e-3, 2e-3, 7)
    found = press(alone, fruit, depths, cells)[:, 0]
    exact = 4.0 / 3.0 / (1.0 - fruit.poisson**2) * math.sqrt(1000.0) * depths**1.5
    return found / exact - 1.0


if __name__ == "__main__":
    for count in (16, 32, 64):
        errors = hertz_error(count)
        print(count, errors.mean(), np.ptp(errors))
    coarse, fine = (press(square(), Fruit(E=1.0, R1=45, R2=100, azimuth=40), [0.4, 0.9], n) for n in (32, 64))
    print(coarse / fine - 1.0)

"""Presses of a sensor of sprung domes on an ellipsoidal fruit: the forces at travels from the first touch.

The gaps are between true spheres and the skin z = -(k_xx x^2 + 2 k_xy x y + k_yy y^2) / 2. Forces and displacements are
along the axis of the sensor: slopes are small, contact is unilateral and frictionless.

An active set finds the cells in contact: cells that would pull leave it, and cells that would penetrate join it. A step
is shortened until it lowers the energy. The forces of a set are found by conjugate gradients, preconditioned by the
inverse of each grid's convolution. Every grid follows its contact from sample to sample, so that the discretisation
error is nearly the same factor for all forces.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Flags, Floats
from solve.presses.grids import Grids, love
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes

Slope = tuple[float, float] | Floats

CELLS = 32  # cells per side of a grid
MOST_STEPS = 400  # steps of conjugate gradients
MOST_SETS = 100  # active sets
LEAST_PART = 1e-3  # least fraction of a step to the forces of an active set
SETTLED = 1e-7  # tolerance of the gap in contact, over the largest interference
NEARLY_FULL = 0.9  # width over the grid from which a contact at its edge may be much wider than the grid
FILLED = (0.72, 0.94)  # allowed width of a contact over its grid, from and to
SOUGHT = 3.0  # [mm], largest distance from a dome's touch on the ellipsoid to its touch on the height map


class Pressing:
    """A sensor on a fruit, pressed to increasing travels.

    `touch` (tips, 2) [mm] are the places of first contact, and `nearest` (tips,) [mm] the gaps there. `give` (tips,)
    [mm/N] is the compliance of the springs; presses over time change it, and `recovered`, before each sample. `grids`
    and `cell_forces` [N] are the last solution, from which the next one starts.
    """

    def __init__(self, sensor: SprungDomes, fruit: EllipsoidFruit, cells: int = CELLS) -> None:
        """Find the place of first contact under each dome.

        Newton's method finds it on the even ellipsoid. If skin or domes have a height map, or domes a rim, a search in
        three finer and finer squares follows.
        """
        self.sensor, self.fruit, self.cells = sensor, fruit, cells
        self.kernel = love(cells)
        self.touch = sensor.positions.copy()
        for _ in range(20):
            step = np.array([np.linalg.solve(*self._slopes(tip)) for tip in range(len(self.touch))])
            self.touch = self.touch - step
        if fruit.bumps is not None or sensor.form is not None or math.isfinite(sensor.rim):
            for half in (SOUGHT, SOUGHT / 40.0, SOUGHT / 1600.0):
                self.touch = self._lowest(half)
        self.give = 1.0 / sensor.K
        self.recovered = np.zeros(len(self.touch))  # recovery of the springs due to relaxation of the flesh [mm]
        self.filled = np.full(len(self.touch), FILLED[0])
        self.nearest = self.gap(self.touch[:, 0, None, None], self.touch[:, 1, None, None])[:, 0, 0]
        bend = np.linalg.eigvalsh(fruit.curvature)[0]  # the smaller curvature, of the flatter direction
        self.widest = 1.0 / (1.0 / sensor.dome_radius + bend)  # largest radius of relative curvature [mm]
        self.grids: Grids | None = None
        self.cell_forces = np.zeros((len(self.touch), cells, cells))

    def _slopes(self, tip: int) -> tuple[Floats, Floats]:
        """Return the second and the first derivatives of the gap at the present estimate of a dome's touch."""
        r = self.sensor.dome_radius
        away = self.touch[tip] - self.sensor.positions[tip]
        fall = math.sqrt(r**2 - away @ away)
        own = np.eye(2) / fall + np.outer(away, away) / fall**3
        beside = self.touch[tip] - self.fruit.apex
        return own + self.fruit.curvature, away / fall + self.fruit.curvature @ beside - self.fruit.slope

    def _lowest(self, half: float) -> Floats:
        """Return the places of the least gap under each dome, in squares of a half side [mm] about the touches."""
        steps = np.linspace(-half, half, 161)
        x = self.touch[:, 0, None, None] + steps[:, None]
        y = self.touch[:, 1, None, None] + steps
        x, y = np.broadcast_arrays(x, y)
        gap = np.where(self._on_domes(x, y), self.gap(x, y), np.inf)
        least = gap.reshape(len(x), -1).argmin(axis=1)
        rows = np.arange(len(x))
        return np.stack([x.reshape(len(x), -1)[rows, least], y.reshape(len(x), -1)[rows, least]], axis=-1)

    def _on_domes(self, x: Floats, y: Floats) -> Flags:
        """Return whether places (tips, ...) [mm] lie within the rims of the domes."""
        away = self.sensor.positions[..., None, None]
        return np.asarray(np.hypot(x - away[:, 0], y - away[:, 1]) <= self.sensor.rim)

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Return the gaps between the domes and the skin [mm], (tips, ...), with the sensor at height 0."""
        r = self.sensor.dome_radius
        dx = x - self.sensor.positions[:, 0, None, None]
        dy = y - self.sensor.positions[:, 1, None, None]
        dome: Floats = r - np.sqrt(np.maximum(r**2 - dx**2 - dy**2, 0.0))
        if self.sensor.form is not None:
            dome = dome - self.sensor.form(np.hypot(dx, dy))
        k: Floats = self.fruit.curvature
        x0, y0 = self.fruit.apex
        skin = 0.5 * (k[0, 0] * (x - x0) ** 2 + 2.0 * k[0, 1] * (x - x0) * (y - y0) + k[1, 1] * (y - y0) ** 2)
        if self.fruit.bumps is not None:
            skin = skin - self.fruit.bumps(x, y)
        out = np.broadcast_to(self.fruit.heights, len(dx))[:, None, None]
        gap: Floats = dome + skin - self.fruit.slope[0] * x - self.fruit.slope[1] * y - out
        return gap

    def forces(self, travel: float, changed_slope: Slope = (0.0, 0.0)) -> Floats:
        """Return the forces of the domes [N] at a travel [mm] from the first touch, (tips,).

        Contact is solved on the grids of the previous travel first. Grids that do not fit their contacts are replaced,
        and the contact is solved again. Raises ArithmeticError if the grids still do not fit after twelve attempts.
        """
        lowered = travel + self.nearest.min() + self.sensor.positions @ np.array(changed_slope) + self.recovered
        entered = lowered - self.nearest
        widest = np.minimum(np.sqrt(2.0 * self.widest * np.maximum(entered, 1e-4)), 1.1 * self.sensor.rim)
        reach = widest if self.grids is None else self.grids.reach
        middles = self.touch if self.grids is None else self.grids.middles
        start = None if self.grids is None else self.cell_forces
        for _ in range(12):
            grids = Grids(middles, reach, self.cells, self.kernel, self.fruit)
            found = self._yielded(grids, lowered, start)
            total: Floats = found.sum(axis=(1, 2))
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
        """Return centres and half widths of grids that fit the contacts, and whether the given grids already fit.

        A contact must fill between `filled` and FILLED[1] of its grid, and must not touch the edge of the grid. `found`
        are the forces of the cells, `entered` (tips,) the interference of the undeformed domes [mm].
        """
        middles, reach = grids.middles.copy(), grids.reach.copy()
        fits = True
        for tip, forces in enumerate(found):
            rows, columns = np.flatnonzero(forces.any(axis=1)), np.flatnonzero(forces.any(axis=0))
            # Out of contact, a small grid stays where the dome will touch: 1.2 contact radii at 2 % of its distance.
            if not len(rows):
                reach[tip] = 1.2 * math.sqrt(self.widest * max(0.02 * abs(entered[tip]), 1e-3))
                middles[tip] = self.touch[tip]
                continue
            first = np.array([rows[0], columns[0]])
            last = np.array([rows[-1], columns[-1]])
            width = (last - first + 1).max() / grids.cells
            edge = first.min() == 0 or last.max() == grids.cells - 1
            if edge or not self.filled[tip] <= width <= FILLED[1]:
                # A contact that is cut off may be much wider. Otherwise the new grid is filled to the middle of FILLED.
                fits = False
                middles[tip] = grids.middles[tip] + 0.5 * (first + last + 1 - grids.cells) * grids.size[tip]
                reach[tip] = grids.reach[tip] * (
                    1.5 if edge and width > NEARLY_FULL else max(width, 2.5 / grids.cells) / 0.83
                )
        return middles, reach, fits

    def _missed(self, grids: Grids, total: Floats, lowered: Floats) -> Flags:
        """Return for each dome whether its height map would touch outside the grid, (tips,).

        Bumps may touch beside the main contact. The skin there sinks as under point forces at the centres of the grids.
        """
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
        touches = outside & self._on_domes(x, y)
        missed: Flags = (touches & (left[:, None, None] - self.gap(x, y) > sunk)).any(axis=(1, 2))
        return missed

    def _yielded(self, grids: Grids, lowered: Floats, start: Floats | None) -> Floats:
        """Return the forces of all cells [N], none above the force at which the flesh yields.

        The set of yielded cells, which carry their largest force, is repeated until it does not change. A yielded cell
        stays in the set while the skin under it sinks less than the dome requires.
        """
        x, y = grids.places()
        wanted = lowered[:, None, None] - self.gap(x, y)
        largest = np.broadcast_to(self.fruit.yields * (grids.size**2)[:, None, None], wanted.shape)
        on_domes = self._on_domes(x, y)
        yielded = np.zeros_like(on_domes)
        for _ in range(MOST_SETS):
            carried = np.where(yielded, largest, 0.0)
            felt = self._sunk(grids, carried) if yielded.any() else 0.0
            begin = None if start is None else np.where(yielded | ~on_domes, 0.0, start)
            found = self._pressed(grids, wanted - felt, begin, on_domes & ~yielded) + carried
            if math.isinf(self.fruit.yields):
                return found
            still = yielded & (self._sunk(grids, found) <= wanted)
            after = still | (found > largest * (1.0 + 1e-9))
            if (after == yielded).all():
                return found
            yielded, start = after, found
        raise ArithmeticError(self.fruit.yields)

    def _sunk(self, grids: Grids, forces: Floats) -> Floats:
        """Return the deflection of fruit and springs under forces of cells [mm]."""
        springs: Floats = self.give[:, None, None] * forces.sum(axis=(1, 2), keepdims=True)
        return self.fruit.compliance * grids.deflection(forces) + springs

    def _pressed(self, grids: Grids, wanted: Floats, start: Floats | None, free: Flags) -> Floats:
        """Return the forces of the free cells [N] with least energy, by an active set that begins with `start`.

        `wanted` [mm] is the displacement of each cell if it touches.
        """

        def sunk(forces: Floats) -> Floats:
            """Return the deflection under forces of cells [mm]."""
            return self._sunk(grids, forces)

        allowed = SETTLED * max(wanted.max(), 1e-6)
        slack = (allowed * grids.size / self.fruit.compliance)[:, None, None]  # moves a cell by a few `allowed`
        active = free & (wanted > 0.0 if start is None else start > 0.0)
        f = np.zeros_like(wanted) if start is None else start
        energy = 0.5 * (f * (sunk(f) - 2.0 * wanted)).sum()
        system = _System(grids, sunk, wanted, 0.5 * allowed)
        for _ in range(MOST_SETS):
            solved, gaps = system.balanced(np.where(active, f, 0.0), active)
            pulls = (solved < -slack).any()
            # If cells would pull, the step is shortened until it lowers the energy.
            before, f, part = f, solved, 1.0
            while pulls and part > LEAST_PART:
                f = np.maximum(before + part * (solved - before), 0.0)
                gaps = sunk(f) - wanted
                part *= 0.5
                if 0.5 * (f * (gaps - wanted)).sum() < energy:
                    break
            energy = 0.5 * (f * (gaps - wanted)).sum()
            enters = free & (f == 0.0) & (gaps < -allowed)
            if not pulls and not enters.any():
                return np.maximum(f, 0.0)
            active = (f > 0.0) | enters
        raise ArithmeticError(allowed)


@dataclass(frozen=True)
class _System:
    """The linear system of cells in contact: forces whose deflection `sunk` is `wanted` within `allowed` [mm]."""

    grids: Grids
    sunk: Callable[[Floats], Floats]
    wanted: Floats
    allowed: float

    def balanced(self, f: Floats, active: Flags) -> tuple[Floats, Floats]:
        """Return the forces of the active cells [N] that deflect them as wanted, and the gaps of all cells [mm].

        It starts from the forces f and uses conjugate gradients, preconditioned by the inverse of each grid's
        convolution.
        """
        gaps = self.sunk(f) - self.wanted
        way, before = np.zeros_like(f), 1.0
        for step in range(MOST_STEPS):
            left = np.where(active, gaps, 0.0)
            if np.abs(left).max() < self.allowed:
                return f, gaps
            smooth = np.where(active, self.grids.stiffened(left), 0.0)
            product = (left * smooth).sum()
            way = -smooth + (product / before if step else 0.0) * way
            before = product
            answer = self.sunk(way)
            length = product / (answer * way).sum()
            f = f + length * way
            gaps = gaps + length * answer
        raise ArithmeticError(np.abs(left).max() / self.allowed)


def press(
    sensor: SprungDomes,
    fruit: EllipsoidFruit,
    travels: Sequence[float] | Floats,
    cells: int = CELLS,
    drift: Slope = (0.0, 0.0),
) -> Floats:
    """Return the forces of the domes at travels [mm] from the first touch, (samples, tips) [N].

    The slope of the sensor grows by `drift` [1] along x and y from the first travel to the last.
    """
    pressing = Pressing(sensor, fruit, cells)
    last = max(travels)
    return np.array([pressing.forces(x, np.multiply(drift, x / last)) for x in travels])

"""Forces on the sprung domes of a sensor that is pressed on an ellipsoidal fruit, at given travels.

The gap is measured between true spheres and the skin z = -(k_xx x^2 + 2 k_xy x y + k_yy y^2) / 2. Slopes are small, so
forces and displacements are taken along the axis of the sensor. Contact is unilateral and frictionless.

The cells in contact are found by an active-set method: cells in tension leave the set, and cells that penetrate join
it. A step is shortened until it lowers the energy. The forces of the active cells are found by conjugate gradients,
preconditioned by the inverse of each grid's convolution. Each grid is moved and resized with its contact from travel to
travel. The discretisation error is then nearly the same factor for all forces.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sensor.arrays import Flags, Floats
from solve.presses.grids import Grids, love_transform
from solve.presses.pressed_bodies import EllipsoidFruit, SprungDomes

Slope = tuple[float, float] | Floats

CELLS = 32  # cells per side of a grid
NEWTON_STEPS = 20  # Newton steps to a point of first contact on a smooth ellipsoid
# Largest distance between a dome's points of first contact with and without bumps, form error and rim [mm].
LARGEST_TOUCH_SHIFT = 3.0
# Half side of the three successive searches for a point of first contact [mm]. Each search covers two intervals of the
# previous, coarser one on either side of its best point.
SEARCH_HALF_SIDES = (LARGEST_TOUCH_SHIFT, LARGEST_TOUCH_SHIFT / 40.0, LARGEST_TOUCH_SHIFT / 1600.0)

# Iterative solution of the contact
MAX_CG_STEPS = 400  # maximum number of conjugate-gradient steps
MAX_ACTIVE_SETS = 100  # maximum number of active sets
SMALLEST_FRACTION = 1e-3  # smallest fraction of a step towards the forces of an active set
GAP_TOLERANCE = 1e-7  # tolerance of the gap in contact, as a fraction of the largest interference
LEAST_INTERFERENCE = 1e-6  # lower bound on the interference [mm], which keeps the tolerance positive
YIELD_MARGIN = 1e-9  # relative excess over the yield force that is attributed to round-off

# Fitting of the grids to their contacts. The fill of a grid is the width of its contact divided by its own width.
SMALLEST_FILL = 0.72  # a grid is replaced if its fill is below this value
LARGEST_FILL = 0.94  # a grid is replaced if its fill is above this value
TARGET_FILL = 0.83  # fill of a new grid, in the middle between these two values
SMALLEST_FITTED_CELLS = 2.5  # number of cells to which a narrower contact is widened when its grid is chosen
# A dome out of contact gets the grid of a contact with a small interference. It is this fraction of the dome's gap, but
# at least this length [mm].
EXPECTED_INTERFERENCE = 0.02
SMALLEST_EXPECTED_INTERFERENCE = 1e-3
EXPECTED_CONTACT_MARGIN = 1.2  # half width of that grid divided by the expected contact radius
CUT_OFF_FILL = 0.9  # fill above which a contact at the edge of its grid may be much wider than the grid
CUT_OFF_GROWTH = 1.5  # factor by which a grid grows if its edge cuts off the contact
WIDENING_FACTOR = 0.8  # factor on the smallest allowed fill of a grid if a bump touches outside it
RIM_FACTOR = 1.1  # largest half width of the first grid divided by the radius of the dome's rim
MAX_GRID_FITS = 12  # maximum number of attempts to fit the grids


class Pressing:
    """A sensor that is pressed on a fruit to increasing travels.

    `touch` (tips, 2) [mm] holds the points of first contact, and `nearest` (tips,) [mm] the gaps there.
    `spring_compliance` (tips,) [mm/N] is the compliance of the springs. `recovered` (tips,) [mm] is the part of their
    deflection that has recovered. `press_with_creep` changes both before each sample. `grids` and `cell_forces` [N]
    hold the previous solution, which is the initial guess of the next one. After a solve, `area` (tips,) [mm^2] holds
    the contact areas.
    """

    def __init__(self, sensor: SprungDomes, fruit: EllipsoidFruit, cells: int = CELLS) -> None:
        """Find the point of first contact and the gap under each dome, before any contact is solved.

        The grids of the contacts, which `forces` places later, have `cells` cells per side.
        """
        tips = len(sensor.positions)
        self.sensor = sensor
        self.fruit = fruit
        self.touch = self._find_touch_points()
        # `gap` expects points with the shape (tips, rows, columns), here a single point for each dome.
        self.nearest = self.gap(self.touch[:, 0, None, None], self.touch[:, 1, None, None])[:, 0, 0]
        # Relative radius of dome and skin in the flatter direction of the skin [mm], which determines the first grids.
        smaller_curvature = np.linalg.eigvalsh(fruit.curvature)[0]
        self.relative_radius = 1.0 / (1.0 / sensor.dome_radius + smaller_curvature)

        # At first, the springs are elastic and nothing has recovered.
        self.spring_compliance = 1.0 / sensor.K
        self.recovered = np.zeros(tips)

        self.cells = cells
        self.kernel = love_transform(cells)  # the same for all grids
        self.smallest_fill = np.full(tips, SMALLEST_FILL)  # smallest allowed fill of each grid
        self.grids: Grids | None = None  # there is no previous solution yet
        self.cell_forces = np.zeros((tips, cells, cells))
        self.area: Floats  # assigned by `forces`

    def _find_touch_points(self) -> Floats:
        """Return the points of first contact (tips, 2) [mm], where the gaps of the domes are smallest.

        Newton's method finds these points for ideal spheres on a smooth ellipsoid, from the axes of the domes. If the
        skin has bumps, or the domes have a form error or a rim, the surroundings of each point are then searched.
        """
        points: Floats = self.sensor.positions.copy()
        for _ in range(NEWTON_STEPS):
            steps = []
            for tip, point in enumerate(points):
                hessian, gradient = self._gap_derivatives(tip, point)
                steps.append(np.linalg.solve(hessian, gradient))
            points = points - np.array(steps)
        if self.fruit.bumps is not None or self.sensor.form is not None or math.isfinite(self.sensor.rim):
            for half_side in SEARCH_HALF_SIDES:
                points = self._find_smallest_gaps(points, half_side)
        return points

    def _gap_derivatives(self, tip: int, point: Floats) -> tuple[Floats, Floats]:
        """Return the Hessian (2, 2) [1/mm] and the gradient (2,) [1] of a dome's gap at a point (2,) [mm].

        The dome is an ideal sphere and the skin a smooth ellipsoid. `tip` is the index of the dome.
        """
        r = self.sensor.dome_radius
        from_axis = point - self.sensor.positions[tip]
        height = math.sqrt(r**2 - from_axis @ from_axis)  # height of the sphere's centre above this point of the dome
        dome_hessian = np.eye(2) / height + np.outer(from_axis, from_axis) / height**3
        from_apex = point - self.fruit.apex
        gradient = from_axis / height + self.fruit.curvature @ from_apex - self.fruit.slope
        return dome_hessian + self.fruit.curvature, gradient

    def _find_smallest_gaps(self, centres: Floats, half_side: float) -> Floats:
        """Return the points of smallest gap (tips, 2) [mm], one in the square around each of the `centres` (tips, 2).

        `half_side` [mm] is half the side of the squares. Points beyond the rim of a dome are excluded.
        """
        offsets = np.linspace(-half_side, half_side, 161)  # intervals of `half_side` / 80
        x = centres[:, 0, None, None] + offsets[:, None]
        y = centres[:, 1, None, None] + offsets
        x, y = np.broadcast_arrays(x, y)
        gap = np.where(self._on_domes(x, y), self.gap(x, y), np.inf)
        smallest = gap.reshape(len(x), -1).argmin(axis=1)
        tips = np.arange(len(x))
        return np.stack([x.reshape(len(x), -1)[tips, smallest], y.reshape(len(x), -1)[tips, smallest]], axis=-1)

    def _on_domes(self, x: Floats, y: Floats) -> Flags:
        """Return whether points x, y (tips, ...) [mm] lie within the rims of their domes."""
        positions = self.sensor.positions[..., None, None]
        return np.asarray(np.hypot(x - positions[:, 0], y - positions[:, 1]) <= self.sensor.rim)

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Return the gap between each dome and the skin [mm] at points x, y (tips, rows, columns) [mm].

        The sensor is at height 0, and both the skin and the springs are undeformed. The gap is the height of the dome
        above its lowest point, plus the depth of the skin below its tangent plane at the apex. The rise of this plane
        and the protrusion of the dome are subtracted.
        """
        dome_height = self._dome_height(x, y)
        skin_depth = self._skin_depth(x, y)
        protrusion = np.broadcast_to(self.fruit.heights, len(x))[:, None, None]
        gap: Floats = dome_height + skin_depth - self.fruit.slope[0] * x - self.fruit.slope[1] * y - protrusion
        return gap

    def _dome_height(self, x: Floats, y: Floats) -> Floats:
        """Return the height of each dome above its lowest point [mm] at points x, y (tips, rows, columns) [mm].

        The form error of the domes is included. Beyond the equator of the sphere, its height is its radius.
        """
        r = self.sensor.dome_radius
        dx = x - self.sensor.positions[:, 0, None, None]
        dy = y - self.sensor.positions[:, 1, None, None]
        height: Floats = r - np.sqrt(np.maximum(r**2 - dx**2 - dy**2, 0.0))
        if self.sensor.form is not None:
            height = height - self.sensor.form(np.hypot(dx, dy))
        return height

    def _skin_depth(self, x: Floats, y: Floats) -> Floats:
        """Return the depth of the skin below its tangent plane at the apex [mm] at points x, y [mm], with its bumps."""
        k: Floats = self.fruit.curvature
        x0, y0 = self.fruit.apex
        depth: Floats = 0.5 * (k[0, 0] * (x - x0) ** 2 + 2.0 * k[0, 1] * (x - x0) * (y - y0) + k[1, 1] * (y - y0) ** 2)
        if self.fruit.bumps is not None:
            depth = depth - self.fruit.bumps(x, y)
        return depth

    def forces(self, travel: float, changed_slope: Slope = (0.0, 0.0)) -> Floats:
        """Return the forces on the domes [N], shape (tips,), at a travel [mm] from the first touch.

        The slope of the sensor along x and y has changed by `changed_slope` [1] since the first touch. Contact is first
        solved on the grids of the previous travel. Grids that do not fit their contacts are replaced, and the contact
        is solved again. The solution is stored in `grids`, `cell_forces` and `area`. Raises ArithmeticError if the
        grids still do not fit after MAX_GRID_FITS attempts, or if a contact or the set of yielded cells does not
        converge.
        """
        # Displacement of the domes without the deflection of their springs [mm]. The sensor touches first where the gap
        # at height 0 is smallest.
        lowering = travel + self.nearest.min() + self.sensor.positions @ np.array(changed_slope) + self.recovered
        # Depth of the undeformed domes below the undeformed skin [mm], which is negative for a dome above the skin.
        interference = lowering - self.nearest
        centres, half_widths, start = self._first_grids(interference)
        for _ in range(MAX_GRID_FITS):
            grids = Grids(centres, half_widths, self.cells, self.kernel, self.fruit)
            cell_forces = self._solve_cell_forces(grids, lowering, start)
            centres, half_widths, fits = self._fit_grids(grids, cell_forces, interference)
            if fits and self.fruit.bumps is not None:
                half_widths, fits = self._widen_grids(grids, cell_forces, lowering, half_widths)
            if fits:
                self.grids = grids
                self.cell_forces = cell_forces
                self.area = (cell_forces > 0.0).sum(axis=(1, 2)) * grids.cell_size**2
                dome_forces: Floats = cell_forces.sum(axis=(1, 2))
                return dome_forces
            start = grids.transfer(centres, half_widths, cell_forces)
        msg = f"The contact grids do not fit their contacts at a travel of {travel:.3g} mm. Use smaller steps."
        raise ArithmeticError(msg)

    def _first_grids(self, interference: Floats) -> tuple[Floats, Floats, Floats | None]:
        """Return the centres and half widths [mm] of the grids that are tried first, and the first guess of the forces.

        Grids and guess [N] come from the previous travel. At the first travel, the grids are at the points of first
        contact, with a size for the `interference` (tips,) [mm], and there is no guess.
        """
        if self.grids is None:
            return self.touch, self._first_half_widths(interference), None
        return self.grids.centres, self.grids.half_widths, self.cell_forces

    def _widen_grids(
        self, grids: Grids, cell_forces: Floats, lowering: Floats, half_widths: Floats
    ) -> tuple[Floats, bool]:
        """Widen each grid beside which a bump would touch, and return all half widths and whether no grid was widened.

        The `half_widths` (tips,) are in mm. A widened grid may then stay wider than its contact requires, because its
        `smallest_fill` is reduced. `cell_forces` (tips, cells, cells) [N] are the forces on the cells of the grids.
        `lowering` (tips,) [mm] is the displacement of the domes, without the deflection of their springs.
        """
        touches_outside = self._touches_outside(grids, cell_forces.sum(axis=(1, 2)), lowering)
        self.smallest_fill[touches_outside] *= WIDENING_FACTOR
        widened = np.where(touches_outside, half_widths / WIDENING_FACTOR, half_widths)
        return widened, not touches_outside.any()

    def _first_half_widths(self, interference: Floats) -> Floats:
        """Return the half widths of the first grids (tips,) [mm], for an interference (tips,) [mm].

        A grid covers the overlap of the undeformed bodies, approximated by paraboloids, but reaches only a little
        beyond the rim of the dome. A dome out of contact gets the grid of an interference of 1e-4 mm.
        """
        overlap_radius = np.sqrt(2.0 * self.relative_radius * np.maximum(interference, 1e-4))
        return np.asarray(np.minimum(overlap_radius, RIM_FACTOR * self.sensor.rim))

    def _fit_grids(self, grids: Grids, cell_forces: Floats, interference: Floats) -> tuple[Floats, Floats, bool]:
        """Return centres and half widths of grids that fit the contacts, and whether the given grids already fit.

        The centres (tips, 2) and the half widths (tips,) are in mm. `cell_forces` (tips, cells, cells) [N] are the
        forces on the cells. `interference` (tips,) [mm] is the depth of the undeformed domes below the undeformed skin.
        The grid of a dome out of contact always fits, but the dome gets a small grid where it will touch.
        """
        centres = grids.centres.copy()
        half_widths = grids.half_widths.copy()
        fits = True
        for tip, forces in enumerate(cell_forces):
            if not forces.any():  # the dome is out of contact
                expected = max(EXPECTED_INTERFERENCE * abs(interference[tip]), SMALLEST_EXPECTED_INTERFERENCE)
                half_widths[tip] = EXPECTED_CONTACT_MARGIN * math.sqrt(self.relative_radius * expected)
                centres[tip] = self.touch[tip]
                continue
            new_grid = self._find_better_grid(grids, tip, forces)
            if new_grid is not None:
                fits = False
                centres[tip], half_widths[tip] = new_grid
        return centres, half_widths, fits

    def _find_better_grid(self, grids: Grids, tip: int, forces: Floats) -> tuple[Floats, float] | None:
        """Return the centre (2,) [mm] and the half width [mm] of a better grid for a contact, or None if its grid fits.

        A grid fits if its contact does not touch its edge, and if its fill is between `smallest_fill` and
        LARGEST_FILL. `forces` (cells, cells) [N] are the forces on its cells, some of which are positive. `tip` is the
        index of the dome.
        """
        # The rows and columns of the cells in contact, which are numbered from 0 along x and along y.
        rows = np.flatnonzero(forces.any(axis=1))
        columns = np.flatnonzero(forces.any(axis=0))
        first = np.array([rows[0], columns[0]])
        last = np.array([rows[-1], columns[-1]])
        fill = (last - first + 1).max() / grids.cells
        is_at_edge = first.min() == 0 or last.max() == grids.cells - 1
        if not is_at_edge and self.smallest_fill[tip] <= fill <= LARGEST_FILL:
            return None
        # The middle of the contact relative to the middle of the grid, in cells, is (first + last + 1 - cells) / 2.
        centre = grids.centres[tip] + 0.5 * (first + last + 1 - grids.cells) * grids.cell_size[tip]
        # If the edge cuts the contact off, its width is unknown, so the grid grows by a fixed factor. Otherwise the new
        # grid has the fill TARGET_FILL. The width of a contact of one or two cells is rounded up, so that the grid does
        # not shrink too fast.
        is_cut_off = is_at_edge and fill > CUT_OFF_FILL
        fitted_fill = max(fill, SMALLEST_FITTED_CELLS / grids.cells)
        growth = CUT_OFF_GROWTH if is_cut_off else fitted_fill / TARGET_FILL
        return centre, grids.half_widths[tip] * growth

    def _touches_outside(self, grids: Grids, dome_forces: Floats, lowering: Floats) -> Flags:
        """Return which domes a bump of the skin would touch outside their grids, shape (tips,).

        Points up to twice the half width of a grid from its centre are checked, along x and along y. `dome_forces`
        (tips,) [N] are the forces on the domes. `lowering` (tips,) [mm] is the displacement of the domes, without the
        deflection of their springs.
        """
        # Coordinates in half widths of a grid. The grid itself ends at -1 and 1.
        coordinates = np.linspace(-2.0, 2.0, 81)
        is_outside = np.maximum(np.abs(coordinates[:, None]), np.abs(coordinates)) > 1.0
        x = grids.centres[:, 0, None, None] + grids.half_widths[:, None, None] * coordinates[:, None]
        y = grids.centres[:, 1, None, None] + grids.half_widths[:, None, None] * coordinates
        x, y = np.broadcast_arrays(x, y)
        skin_deflection = self._far_deflection(grids.centres, dome_forces, x, y)
        dome_lowering = lowering - self.spring_compliance * dome_forces
        is_candidate = is_outside & self._on_domes(x, y)
        overlap = dome_lowering[:, None, None] - self.gap(x, y)
        return np.asarray((is_candidate & (overlap > skin_deflection)).any(axis=(1, 2)))

    def _far_deflection(self, centres: Floats, dome_forces: Floats, x: Floats, y: Floats) -> Floats:
        """Return the deflection of the skin [mm] at points x, y (tips, rows, columns) [mm] far from the contacts.

        The deflection is computed as if the `dome_forces` (tips,) [N] acted at the `centres` (tips, 2) [mm].
        """
        # Distance of each point from each centre, shape (tips, centres, rows, columns). The lower limit of 1e-3 mm
        # avoids a division by 0 at a centre.
        distance = np.hypot(x[:, None] - centres[:, 0, None, None], y[:, None] - centres[:, 1, None, None]).clip(1e-3)
        return np.asarray(self.fruit.compliance * (dome_forces[:, None, None] / distance).sum(axis=1))

    def _solve_cell_forces(self, grids: Grids, lowering: Floats, start: Floats | None) -> Floats:
        """Return the forces on all cells [N], each limited to the force at which the flesh yields.

        The forces and `start` have the shape (tips, cells, cells). `lowering` (tips,) [mm] is the displacement of the
        domes, without the deflection of their springs. `start` [N] is the initial guess of the forces, or None. Raises
        ArithmeticError if the set of cells in contact or the set of yielded cells does not converge.
        """
        x, y = grids.positions()
        required = lowering[:, None, None] - self.gap(x, y)  # deflection of each cell if it touches its dome
        on_domes = self._on_domes(x, y)
        if math.isinf(self.fruit.yields):  # the flesh is elastic
            return self._solve_contact_forces(grids, required, start, on_domes)
        return self._solve_yielding_forces(grids, required, start, on_domes)

    def _solve_yielding_forces(self, grids: Grids, required: Floats, start: Floats | None, on_domes: Flags) -> Floats:
        """Return the forces on all cells [N] if the flesh yields. All arrays have the shape (tips, cells, cells).

        Yielded cells carry their yield force, and the forces on the other cells are solved elastically. The set of
        yielded cells is found by iteration. A cell remains yielded as long as the skin under it is deflected by less
        than the dome requires.

        `required` [mm] is the deflection of each cell if it touches its dome. `start` [N] is the initial guess of the
        forces, or None. Only cells marked in `on_domes` can touch. Raises ArithmeticError if the set of cells in
        contact or the set of yielded cells does not converge.
        """
        force_limits = np.broadcast_to(self.fruit.yields * (grids.cell_size**2)[:, None, None], required.shape)
        is_yielded = np.zeros_like(on_domes)
        guess = start
        for _ in range(MAX_ACTIVE_SETS):
            yield_forces = np.where(is_yielded, force_limits, 0.0)
            yield_deflection = self._deflection(grids, yield_forces) if is_yielded.any() else 0.0
            is_elastic = on_domes & ~is_yielded
            elastic_forces = self._solve_contact_forces(grids, required - yield_deflection, guess, is_elastic)
            forces = elastic_forces + yield_forces
            remains_yielded = is_yielded & (self._deflection(grids, forces) <= required)
            is_overloaded = forces > force_limits * (1.0 + YIELD_MARGIN)
            next_yielded = remains_yielded | is_overloaded
            if (next_yielded == is_yielded).all():
                return forces
            is_yielded = next_yielded
            guess = forces
        limit = f"the yield pressure of {self.fruit.yields:.3g} MPa"
        msg = f"The set of cells at {limit} still changes after {MAX_ACTIVE_SETS} iterations. Reduce the travel."
        raise ArithmeticError(msg)

    def _deflection(self, grids: Grids, forces: Floats) -> Floats:
        """Return the total deflection of fruit and springs at each cell [mm], under forces on the cells [N]."""
        springs: Floats = self.spring_compliance[:, None, None] * forces.sum(axis=(1, 2), keepdims=True)
        return self.fruit.compliance * grids.deflection(forces) + springs

    def _solve_contact_forces(self, grids: Grids, required: Floats, start: Floats | None, free: Flags) -> Floats:
        """Return the nonnegative forces f on the cells [N] that minimise the energy, by an active-set method.

        The energy [N mm] is f.(A f - 2 required) / 2, where A f is the deflection of the cells under f. `required` [mm]
        is the deflection of each cell if it is in contact. The gap of a cell is A f - required, which is negative if
        the dome penetrates it. Only cells marked in `free` may carry a force. `start` [N] is the initial guess of the
        forces, or None. All arrays are (tips, cells, cells). Raises ArithmeticError if the active set does not
        converge.
        """
        tolerance = GAP_TOLERANCE * max(required.max(), LEAST_INTERFERENCE)  # of a gap [mm]
        # Tension that would move a cell by only a few tolerances is ignored [N].
        ignored_tension = (tolerance * grids.cell_size / self.fruit.compliance)[:, None, None]
        deflection = functools.partial(self._deflection, grids)  # A f as a function of f
        system = _System(grids, deflection, required, 0.5 * tolerance)
        # The active cells are assumed to be in contact. At first, these are the cells that carry a force in the guess
        # or, without a guess, the cells in which the undeformed bodies overlap.
        if start is None:
            f = np.zeros_like(required)
            active = free & (required > 0.0)
        else:
            f = np.where(free, start, 0.0)
            active = f > 0.0
        energy = _energy(f, deflection(f) - 2.0 * required)
        for _ in range(MAX_ACTIVE_SETS):
            solution, gaps = system.solve(np.where(active, f, 0.0), active)
            has_tension = (solution < -ignored_tension).any()
            if has_tension:
                f, gaps = system.shortened_step(f, solution, energy)
            else:
                f = solution
            energy = _energy(f, gaps - required)
            # Cells in tension have left the active set. Cells without a force that penetrate the dome enter it.
            enters = free & (f == 0.0) & (gaps < -tolerance)
            if not has_tension and not enters.any():
                return np.maximum(f, 0.0)
            active = (f > 0.0) | enters
        msg = f"The set of cells in contact still changes after {MAX_ACTIVE_SETS} iterations. Reduce the travel."
        raise ArithmeticError(msg)


@dataclass(frozen=True)
class _System:
    """The linear system of the cells in contact: their `deflection` must equal `required` within `tolerance` [mm].

    `deflection` maps the forces on all cells [N] to the deflections of all cells [mm].
    """

    grids: Grids
    deflection: Callable[[Floats], Floats]
    required: Floats
    tolerance: float

    def solve(self, f: Floats, active: Flags) -> tuple[Floats, Floats]:
        """Return the forces on the active cells [N] that give the required deflection, and the gaps of all cells [mm].

        A gap is the deflection of a cell minus its required deflection. The method is conjugate gradients,
        preconditioned by the inverse of each grid's convolution. `f` [N] is the initial guess of the forces, and 0 on
        all cells not marked in `active`. All arrays are (tips, cells, cells). Raises ArithmeticError if the iteration
        does not converge.
        """
        gaps = self.deflection(f) - self.required
        direction = np.zeros_like(f)
        previous_product = math.inf  # so that the first direction is only the preconditioned residual
        for _ in range(MAX_CG_STEPS):
            residual = np.where(active, gaps, 0.0)
            if np.abs(residual).max() < self.tolerance:
                return f, gaps
            preconditioned = np.where(active, self.grids.precondition(residual), 0.0)
            product = (residual * preconditioned).sum()
            direction = -preconditioned + product / previous_product * direction
            previous_product = product
            change = self.deflection(direction)
            step_length = product / (change * direction).sum()
            f = f + step_length * direction
            gaps = gaps + step_length * change
        excess = np.abs(residual).max() / self.tolerance
        msg = (
            f"After {MAX_CG_STEPS} conjugate-gradient steps, the residual is {excess:.3g} times the tolerance. "
            "Reduce the travel."
        )
        raise ArithmeticError(msg)

    def shortened_step(self, previous: Floats, solution: Floats, energy: float) -> tuple[Floats, Floats]:
        """Return forces without tension [N] on the way from `previous` to `solution`, and the gaps of all cells [mm].

        Tension is set to zero, and the step is halved until the energy is less than `energy` [N mm], the energy of
        `previous`. If no fraction above SMALLEST_FRACTION achieves this, the forces of the last fraction are returned.
        """
        fraction = 1.0
        while fraction > SMALLEST_FRACTION:
            f = np.maximum(previous + fraction * (solution - previous), 0.0)
            gaps = self.deflection(f) - self.required
            if _energy(f, gaps - self.required) < energy:
                break
            fraction *= 0.5
        return f, gaps


def _energy(f: Floats, excess: Floats) -> float:
    """Return the energy f.(A f - 2 required) / 2 [N mm] of forces f [N] on cells, given `excess` = A f - 2 required."""
    return float(0.5 * (f * excess).sum())


def press(
    sensor: SprungDomes,
    fruit: EllipsoidFruit,
    travels: Sequence[float] | Floats,
    cells: int = CELLS,
    drift: Slope = (0.0, 0.0),
) -> Floats:
    """Return the forces on the domes [N], shape (samples, tips), at increasing travels [mm] from the first touch.

    `cells` is the number of cells per side of the contact grid under each dome. The slope of the sensor changes in
    proportion to the travel. At the last travel it has changed by `drift` [1] along x and y. Raises ArithmeticError if
    the contact at a travel cannot be solved.
    """
    pressing = Pressing(sensor, fruit, cells)
    last_travel = max(travels)
    return np.array([pressing.forces(travel, np.multiply(drift, travel / last_travel)) for travel in travels])

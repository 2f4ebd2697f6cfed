"""Unilateral contact of sprung tips: for each cell, pressure >= 0, gap >= 0, and one of them is 0.

Let f be the forces of the cells divided by E, and A the compliance of the cells times E. Let C be the compliance of the
springs, and b the travel of the tip minus the initial gap. For every cell,

    A f + E (C F)_tip - b >= 0,   f >= 0,   one of them is 0,     F_tip = sum of f over the cells of the tip.

A primal-dual active-set method finds the cells in contact (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2003) 865,
doi:10.1137/S1052623401383558). If it cycles, nonnegative least squares on the Cholesky factor (Lawson and Hanson)
solves the problem.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from sensor.arrays import Flags, Floats
from solve.contact.pressure_cells import ContactCells
from solve.linear import SolveError

MOST_STEPS = 60  # maximum number of active sets; if more are needed, the method is assumed to cycle
COMPLEMENTARITY = 1e-8  # largest allowed violation of the conditions, relative to the largest force and length


class IndefiniteCellsError(SolveError):
    """The compliance of the cells is not positive definite, although the compliance of every elastic body is.

    The half-space part and the remainder of the compliance are then inconsistent.
    """

    def __init__(self) -> None:
        """Compose the message, which includes a hint for the user."""
        hint = "Use a fruit with a smaller height relative to its length and width, or larger tips."
        super().__init__(f"unilateral contact: the compliance of the cells must be positive definite. {hint}")


@dataclass(frozen=True, eq=False)
class ContactState:
    """The solution of a contact problem, with forces and pressures divided by E.

    `F` (tips,) [mm^2] holds the forces of the tips. `slope` (tips,) [mm] holds their derivatives with respect to the
    travel while the same cells touch. `pressure` [1] and `gap` [mm] have shape (cells,). The gap of a cell outside the
    face of its tip is infinite.
    """

    F: Floats
    slope: Floats
    pressure: Floats
    gap: Floats


class UnilateralContact:
    """A contact solver for one set of cells, with any springs, travels and gaps.

    It keeps the Cholesky factor of the last solve, and reuses it if the same cells touch in the next one.
    """

    def __init__(self, cells: ContactCells) -> None:
        """Store the cells. Initially, none of them is in contact."""
        self._cells = cells
        self._tips = cells.tips  # the incidence matrix T (cells, tips)
        self._touching = np.zeros(len(cells.owner), dtype=bool)
        # Cholesky factor of A for the touching cells, and their forces A^-1 T under a unit indentation of each tip.
        self._cholesky: tuple[Floats, bool] = (np.zeros((0, 0)), True)
        self._unit_indentation_forces = np.zeros((0, self._tips.shape[1]))

    def solve(self, interference: Floats, compliance: Floats) -> ContactState:
        """Return the contact for a given interference (cells,) [mm], which is the travel of the tip minus the gap.

        The interference is -inf for a cell outside the face of its tip. `compliance` (tips, tips) [1/mm] is the
        compliance of the springs times E. The factor of the compliance of the touching cells is kept for the next call.
        Raises SolveError if the solution violates a contact condition by more than 1e-8 of the largest value. Raises
        IndefiniteCellsError if the compliance of the cells is not positive definite.
        """
        is_on_face = np.isfinite(interference)
        b = np.where(is_on_face, interference, -1.0)  # any value below 0 serves for cells that never touch
        try:
            f = self._solve_by_active_sets(is_on_face, b, compliance)
            if f is None:
                f = self._solve_by_least_squares(is_on_face, b, compliance)
        except np.linalg.LinAlgError as error:
            raise IndefiniteCellsError from error
        gap = self._gap(f, b, compliance)
        _check_complementarity(f, np.where(is_on_face, gap, 0.0), b)  # cells outside the faces have no gap to check
        return ContactState(
            F=self._tips.T @ f,
            # Per unit travel, the interference of each touching cell increases by 1.
            slope=self._tips.T @ self._closing_forces(f > 0.0, np.ones(len(f)), compliance),
            pressure=f / self._cells.areas,
            gap=np.where(is_on_face, gap, np.inf),
        )

    def _solve_by_active_sets(self, is_on_face: Flags, b: Floats, compliance: Floats) -> Floats | None:
        """Return the forces of the cells divided by E (cells,) [mm^2], or None if the active-set method cycles.

        The active cells are assumed to touch. In each step, the cells whose force or gap contradicts this assumption
        switch between active and inactive, until no cell does. The method starts from the cells that touched in the
        last solve.
        `is_on_face` (cells,) marks the cells on the faces of tips. `b` (cells,) [mm] is the interference, and
        `compliance` (tips, tips) [1/mm] is the compliance of the springs times E.
        """
        overlaps = is_on_face & (b > 0.0)
        active = self._touching & overlaps
        if not active.any():  # without a useful last solve, start from all cells that overlap the fruit
            active = overlaps
        for _ in range(MOST_STEPS):
            f = self._closing_forces(active, b, compliance)
            gap = self._gap(f, b, compliance)
            stays_in_contact = f > 0.0  # for an active cell: its force is compressive
            comes_into_contact = gap < -COMPLEMENTARITY * np.abs(b)  # for any other cell: it penetrates the fruit
            touching = is_on_face & np.where(active, stays_in_contact, comes_into_contact)
            if np.array_equal(touching, active):
                return f
            active = touching
        return None

    def _closing_forces(self, active: Flags, b: Floats, compliance: Floats) -> Floats:
        """Return the forces f (cells,) [mm^2], divided by E, that close the gap of the active cells; all others are 0.

        The forces solve A f = b - E C F for the active cells, where F holds the sums of f over the tips. `b` (cells,)
        [mm] is the interference, and `compliance` (tips, tips) [1/mm] is E C. By the Woodbury formula, one factor of A
        serves all springs and moduli.
        """
        f = np.zeros(len(b))
        if not active.any():
            return f
        incidence = self._tips[active]
        if not np.array_equal(self._touching, active):  # otherwise the factor of the last solve is reused
            matrix = self._cells.compliance[np.ix_(active, active)]
            self._cholesky = cho_factor(matrix, lower=True, check_finite=False)
            self._unit_indentation_forces = cho_solve(self._cholesky, incidence)
            self._touching = active.copy()
        # Summing f = A^-1 b - (A^-1 T) E C F over the cells of each tip, F = T^T f, gives a small system for F.
        without_springs = cho_solve(self._cholesky, b[active])
        system = np.eye(incidence.shape[1]) + (incidence.T @ self._unit_indentation_forces) @ compliance
        F = np.linalg.solve(system, incidence.T @ without_springs)
        f[active] = without_springs - self._unit_indentation_forces @ (compliance @ F)
        return f

    def _gap(self, f: Floats, b: Floats, compliance: Floats) -> Floats:
        """Return the gap A f + E C F - b of all cells [mm], where f are their forces and `compliance` is E C."""
        return self._cells.compliance @ f + self._tips @ (compliance @ (self._tips.T @ f)) - b

    def _solve_by_least_squares(self, is_on_face: Flags, b: Floats, compliance: Floats) -> Floats:
        """Return the forces f >= 0 (cells,) [mm^2], divided by E, that minimise f.M f / 2 - b.f.

        The minimum satisfies the contact conditions. This method is slower than the active sets, but always ends. Only
        cells marked in `is_on_face` may carry a force. M is the combined compliance of cells and springs, and
        `compliance` (tips, tips) [1/mm] is the compliance of the springs times E. L is the Cholesky factor of M. The
        objective has the same minimum as |L^T f - L^-1 b|, which is a problem of nonnegative least squares.
        """
        from scipy.optimize import nnls  # rarely needed, and slow to load

        incidence = self._tips[is_on_face]  # 1 in the column of a cell's own tip
        matrix = self._cells.compliance[np.ix_(is_on_face, is_on_face)] + incidence @ compliance @ incidence.T
        lower = cholesky(matrix, lower=True)
        right_side = solve_triangular(lower, b[is_on_face], lower=True)
        f = np.zeros(len(b))
        # The limit is well above SciPy's default of three iterations per unknown.
        f[is_on_face], _ = nnls(lower.T, right_side, maxiter=50 * len(matrix))
        return f


def _check_complementarity(f: Floats, gap: Floats, b: Floats) -> None:
    """Raise SolveError if a cell violates the contact conditions by more than 1e-8.

    The possible violations are a negative force, a negative gap, and a force across an open gap. Each violation is
    relative to the largest force in `f` [mm^2] and the largest interference in `b` [mm]. Like both, `gap` [mm] has
    shape (cells,).
    """
    # If all values are 0, the scale is 1, which avoids 0 / 0.
    largest_length = float(np.abs(b).max()) or 1.0
    largest_force = float(np.abs(f).max()) or 1.0
    tension = -float(f.min()) / largest_force
    penetration = -float(gap.min()) / largest_length
    force_at_gap = float(np.abs(f * gap).max()) / (largest_force * largest_length)
    worst = max(tension, penetration, force_at_gap)
    # The comparison is negated, so that nan is rejected too.
    if not worst <= COMPLEMENTARITY:
        msg = (
            f"unilateral contact: relative error {worst:.1e} of the complementarity conditions must be at most "
            f"{COMPLEMENTARITY:.0e}. Use more cells or a smaller travel."
        )
        raise SolveError(msg)

"""Unilateral contact of the tips: pressure >= 0, gap >= 0, never both above 0; springs in series with each tip.

Let f be the forces of the cells over E, C the springs' compliance, and b the travel of the tip less the undeformed gap.
For every cell

    A f + E (C F)_tip - b >= 0,   f >= 0,   one of them 0,     F_tip = sum of the tip's f.

A primal-dual active set method finds the touching cells (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2003) 865,
doi:10.1137/S1052623401383558). If it cycles, non-negative least squares on the Cholesky factor is used (Lawson and
Hanson).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from sensor.arrays import Flags, Floats
from solve.contact.pressure_cells import ContactCells
from solve.linear import SolveError

MOST_STEPS = 60  # steps of the active set; more mean that it cycles
COMPLEMENTARITY = 1e-8  # largest violation of the conditions, relative to the largest force and length


class IndefiniteCellsError(SolveError):
    """Cells whose compliance is not positive definite, which no elastic body has: its parts are inconsistent."""

    def __init__(self) -> None:
        """State the fault and the remedy in one line."""
        hint = "take a fruit that is lower for its length and width, or larger tips"
        super().__init__(f"unilateral contact: the compliance of the cells must be positive definite; {hint}")


@dataclass(frozen=True, eq=False)
class ContactState:
    """State of contact: force of each tip over E, `F` (tips,) [mm^2].

    `slope` (tips,) [mm] is dF over E per travel of the housing while the same cells touch. `pressure` over E [1] and
    `gap` [mm] are per cell; a cell without a face has an infinite gap.
    """

    F: Floats
    slope: Floats
    pressure: Floats
    gap: Floats


class UnilateralContact:
    """A solver for one set of cells with any springs, travels and gaps; it keeps the last factor."""

    def __init__(self, cells: ContactCells) -> None:
        """Store the cells and their compliance."""
        self._cells = cells
        self._tips = cells.tips
        self._touching = np.zeros(len(cells.owner), dtype=bool)
        # Cholesky factor of the touching cells, and their forces under a unit rigid indentation of each tip.
        self._cholesky: tuple[Floats, bool] = (np.zeros((0, 0)), True)
        self._rigid_forces = np.zeros((0, self._tips.shape[1]))

    def solve(self, interference: Floats, compliance: Floats) -> ContactState:
        """Return the contact for interference = travel of the tip - gap (cells,) [mm]; -inf for a cell without a face.

        `compliance` (tips, tips) [1/mm] is the compliance of the springs times E. Raises SolveError if the solution
        violates complementarity by more than 1e-8, and IndefiniteCellsError if no body has the compliance of the cells.
        """
        faces = np.isfinite(interference)
        b = np.where(faces, interference, -1.0)
        try:
            f = self._active_set(faces, b, compliance)
            if f is None:
                f = self._least_squares(faces, b, compliance)
        except np.linalg.LinAlgError as error:
            raise IndefiniteCellsError from error
        gap = self._gap(f, b, compliance)
        _check_complementarity(f, np.where(faces, gap, 0.0), b)
        return ContactState(
            F=self._tips.T @ f,
            slope=self._tips.T @ self._forces(f > 0.0, np.ones(len(f)), compliance),
            pressure=f / self._cells.areas,
            gap=np.where(faces, gap, np.inf),
        )

    def _active_set(self, faces: Flags, b: Floats, compliance: Floats) -> Floats | None:
        """Return the forces of the cells, starting from the cells that touched last; None if the active set cycles."""
        entered = faces & (b > 0.0)
        active = self._touching & entered
        if not active.any():
            active = entered
        for _ in range(MOST_STEPS):
            f = self._forces(active, b, compliance)
            gap = self._gap(f, b, compliance)
            touching = faces & np.where(active, f > 0.0, gap < -COMPLEMENTARITY * np.abs(b))
            if np.array_equal(touching, active):
                return f
            active = touching
        return None

    def _forces(self, active: Flags, b: Floats, compliance: Floats) -> Floats:
        """Return the forces that close the gap of the active cells.

        They solve A f = b - E C F with F the sums of f over the tips. By Woodbury's formula, one factor of A serves all
        springs and moduli.
        """
        f = np.zeros(len(b))
        if not active.any():
            return f
        tips = self._tips[active]
        if not np.array_equal(self._touching, active):  # else the factor of the last solve serves
            matrix = self._cells.compliance[np.ix_(active, active)]
            self._cholesky = cho_factor(matrix, lower=True, check_finite=False)
            self._rigid_forces = cho_solve(self._cholesky, tips)
            self._touching = active.copy()
        # f = A^-1 b - (A^-1 T) E C F, and its sums over the tips, F = T^T f, give a small system for F.
        without_springs = cho_solve(self._cholesky, b[active])
        system = np.eye(tips.shape[1]) + (tips.T @ self._rigid_forces) @ compliance
        F = np.linalg.solve(system, tips.T @ without_springs)
        f[active] = without_springs - self._rigid_forces @ (compliance @ F)
        return f

    def _gap(self, f: Floats, b: Floats, compliance: Floats) -> Floats:
        return self._cells.compliance @ f + self._tips @ (compliance @ (self._tips.T @ f)) - b

    def _least_squares(self, faces: Flags, b: Floats, compliance: Floats) -> Floats:
        """Return argmin f.M f / 2 - b.f over f >= 0 as the least-squares problem |L^T f - L^-1 b|, with M = L L^T."""
        from scipy.optimize import nnls  # seldom needed, and slow to load

        tips = self._tips[faces]
        matrix = self._cells.compliance[np.ix_(faces, faces)] + tips @ compliance @ tips.T
        lower = cholesky(matrix, lower=True)
        f = np.zeros(len(b))
        f[faces] = nnls(lower.T, solve_triangular(lower, b[faces], lower=True), maxiter=50 * len(matrix))[0]
        return f


def _check_complementarity(f: Floats, gap: Floats, b: Floats) -> None:
    """Raise SolveError if a force or a gap is negative, or both are above 0, by more than 1e-8 of the largest."""
    length = float(np.abs(b).max()) or 1.0  # 1 if all values are 0, to avoid 0 / 0
    force = float(np.abs(f).max()) or 1.0
    pulling = -float(f.min()) / force
    entered = -float(gap.min()) / length
    both = float(np.abs(f * gap).max()) / (force * length)
    worst = max(pulling, entered, both)
    if not worst <= COMPLEMENTARITY:
        msg = (
            f"unilateral contact: complementarity {worst:.1e} must be at most {COMPLEMENTARITY:.0e}; "
            "take more cells or a smaller travel"
        )
        raise SolveError(msg)

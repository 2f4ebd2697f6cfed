"""Direct solution of sparse symmetric linear systems with prescribed dofs, by SciPy's SuperLU.

One factorisation serves many loads, and the residual of each solution is checked. A system whose matrix is close to a
factorised one is solved by conjugate gradients, with the factorisation as preconditioner.
"""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, cg, splu

from sensor.arrays import Floats, Ints
from sensor.machine_error import MachineError
from solve.solve_error import SolveError as SolveError

RESIDUAL_LIMIT = 1e-9  # largest relative residual
CG_TOLERANCE = 1e-9  # residual divided by the norm of the load; the error of a compliance is of the order of its square
MOST_CG_STEPS = 200  # maximum number of iterations; a bent mesh usually takes 20
MOST_ROUND_OFF = 1e-4  # largest allowed round-off error divided by the largest displacement
EPSILON = float(np.finfo(np.float64).eps)
MOST_BYTES = 4.0 * 2**30  # largest allowed memory of a factorisation; a larger one would take minutes
# Bytes of a factorisation divided by n^(4/3), where n is the number of unknowns. Each nonzero takes 14 bytes. A housing
# of hexahedra with 1e5 unknowns has about 31 n^(4/3) nonzeros. A fruit of tetrahedra has 19 n^(4/3) for 2e5 unknowns,
# and 50 n^(4/3) for 3e4 unknowns, which need little memory.
FACTOR_BYTES = 14.0 * 31.0
# Number of columns at the bottom of the elimination tree that SuperLU merges. The value 1, which merges none, was
# fastest.
_MERGED_COLUMNS = 1


@dataclass(frozen=True)
class Factor:
    """A factorised stiffness matrix K, for which many loads can be solved.

    The displacements of the dofs `fixed` are prescribed, and the displacements of the dofs `free` are unknown. `matrix`
    is K, and `block` is its submatrix for the free dofs, in the order of `free`. `back_substitute` applies the inverse
    of `block` to right-hand sides of shape (free,) or (free, loads).
    """

    matrix: csc_matrix
    block: csc_matrix
    free: Ints
    fixed: Ints
    back_substitute: Callable[[Floats], Floats]

    def solve(self, load: Floats, prescribed: Floats | None = None) -> Floats:
        """Solve K u = load on the free dofs, and return the displacements u [mm], shape (dofs,) or (dofs, loads).

        `load` [N] has the shape of u. `prescribed` [mm] are the displacements of the fixed dofs, in the order of
        `fixed`; by default they are 0. Raises SolveError if the relative residual on the free dofs exceeds 1e-9.
        """
        u = np.zeros_like(load, dtype=np.float64)
        right_side = load[self.free]
        if prescribed is not None:  # move the forces due to the prescribed displacements to the right-hand side
            u[self.fixed] = prescribed
            right_side = right_side - (self.matrix @ u)[self.free]
        solution = self.back_substitute(right_side)
        # One step of iterative refinement reduces the round-off error.
        solution = solution + self.back_substitute(right_side - self.block @ solution)
        _check_residual(self.block, solution, right_side)
        u[self.free] = solution
        return u

    def solve_near(self, matrix: csc_matrix, load: Floats) -> Floats:
        """Return the displacements u [mm] for another `matrix` close to K, with the same fixed dofs held at 0.

        An iterative solution is cheaper than another factorisation. u and `load` [N] have the shape (dofs, loads). The
        method is conjugate gradients, preconditioned by the factorisation of K: the closer the matrix is to K, the
        fewer iterations it needs. Raises SolveError if the relative residual on the free dofs exceeds 1e-9.
        """
        block = csc_matrix(matrix[:, self.free][self.free])
        preconditioner = LinearOperator(block.shape, matvec=self.back_substitute, dtype=np.float64)
        right_sides = load[self.free]
        columns = []
        for right_side in right_sides.T:
            # The status that SciPy returns is not needed, because the residual is checked below.
            column, _ = cg(block, right_side, rtol=CG_TOLERANCE, atol=0.0, maxiter=MOST_CG_STEPS, M=preconditioner)
            columns.append(column)
        solution = np.column_stack(columns)
        _check_residual(block, solution, right_sides)
        u = np.zeros_like(load, dtype=np.float64)
        u[self.free] = solution
        return u


def magnitude(matrix: csc_matrix) -> csc_matrix:
    """Return the matrix of absolute values. It shares the index arrays of `matrix`, which abs() would copy."""
    return csc_matrix((np.abs(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)


def _check_residual(block: csc_matrix, solution: Floats, right_side: Floats) -> None:
    """Raise SolveError if the largest residual of a solution u exceeds 1e-9 times the largest row sum of |K_ij u_j|.

    K is `block`, and u is `solution`. The row sum is the size of the terms that the residual subtracts.
    """
    residual = float(np.abs(block @ solution - right_side).max(initial=0.0))
    scale = float((magnitude(block) @ np.abs(solution)).max(initial=0.0)) or 1.0  # 1 if u is 0, to avoid 0 / 0
    # The comparison is negated, so that nan is rejected too.
    if not residual <= RESIDUAL_LIMIT * scale:
        msg = (
            f"linear solve: relative residual {residual / scale:.1e} must be at most {RESIDUAL_LIMIT:.0e}. "
            "Check the clamp and the mesh."
        )
        raise SolveError(msg)


def factorise(matrix: csc_matrix, fixed: Ints) -> Factor:
    """Factorise a symmetric positive definite matrix (dofs, dofs), with the dofs `fixed` (n,) prescribed.

    The rows and columns of the fixed dofs are removed before the factorisation. Raises SolveError if the matrix is
    singular, for example because the part is not clamped. Raises SolveError or MachineError if the factorisation would
    need too much memory; see `check_cost`.
    """
    check_cost(matrix.shape[0])
    fixed = np.unique(fixed)
    ascending_free = np.setdiff1d(np.arange(matrix.shape[0]), fixed, assume_unique=True)
    # With the dofs in descending order, the factorisation has 5 % fewer nonzeros.
    block = _reverse(csc_matrix(matrix[:, ascending_free][ascending_free]))
    free = ascending_free[::-1]
    back_substitute: Callable[[Floats], Floats] = np.copy  # serves an empty block, which SuperLU cannot factorise
    if len(free):
        back_substitute = _factorise_block(block)
        _check_condition(block, back_substitute)
    return Factor(matrix=matrix, block=block, free=free, fixed=fixed, back_substitute=back_substitute)


def _reverse(matrix: csc_matrix) -> csc_matrix:
    """Return a square matrix whose n rows and n columns are in reverse order: i becomes n - 1 - i.

    Reversing the arrays of the sparse matrix has this effect, and keeps the indices sorted.
    """
    data = matrix.data[::-1].copy()
    indices = matrix.shape[0] - 1 - matrix.indices[::-1]
    pointers = matrix.nnz - matrix.indptr[::-1]
    return csc_matrix((data, indices, pointers), shape=matrix.shape)


def _check_condition(block: csc_matrix, back_substitute: Callable[[Floats], Floats]) -> None:
    """Raise SolveError if the condition number |K^-1| |K| is so large that round-off would leave too few digits.

    K is `block`, and `back_substitute` applies its inverse. |K^-1| is estimated from one right-hand side without zeros.
    The entries of this right-hand side are at most 1, so the largest entry of the solution is a lower bound of |K^-1|.
    """
    probe = np.cos(np.arange(block.shape[0], dtype=np.float64))
    inverse_norm = float(np.abs(back_substitute(probe)).max())
    norm = float(magnitude(block).sum(axis=0).max())
    condition = inverse_norm * norm
    limit = MOST_ROUND_OFF / EPSILON  # the relative round-off error is about the condition number times epsilon
    # The comparison is negated, so that nan is rejected too.
    if not condition <= limit:
        raise SolveError(_singular(f"condition number {condition:.0e} must be at most {limit:.0e}"))


def _factorise_block(block: csc_matrix) -> Callable[[Floats], Floats]:
    """Factorise a symmetric positive definite matrix with SuperLU, and return a function that applies its inverse.

    The function takes right-hand sides of shape (n,) or (n, loads). Raises SolveError if the matrix is singular, and
    MemoryError if there is not enough memory.
    """
    try:
        factor = splu(
            block,
            permc_spec="MMD_AT_PLUS_A",  # minimum degree ordering, which leaves few nonzeros in the factor
            diag_pivot_thresh=0.0,  # pivots on the diagonal, which is stable for a positive definite matrix
            relax=_MERGED_COLUMNS,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        if "singular" not in str(error):  # SuperLU's only other error is a failed allocation
            raise MemoryError(str(error)) from error
        raise SolveError(_singular(error)) from error
    back_substitute: Callable[[Floats], Floats] = factor.solve
    return back_substitute


def factor_bytes(unknowns: int) -> float:
    """Return the approximate memory of a factorised matrix [byte] with this number of unknowns."""
    return FACTOR_BYTES * math.pow(unknowns, 4.0 / 3.0)


def check_cost(unknowns: int) -> None:
    """Check that the factorisation of a matrix with this many unknowns fits into memory, before any is allocated.

    Raises SolveError if the factorisation needs more than 4 GiB. Raises MachineError if it needs less than that, but
    more than the memory of the machine.
    """
    machine_bytes = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    if factor_bytes(unknowns) > MOST_BYTES:
        hint = "Use a smaller fruit, shorter leaves or a larger --tol."
        raise SolveError(_memory_message(unknowns, MOST_BYTES, hint))
    if factor_bytes(unknowns) > machine_bytes:
        hint = "Use a machine with more memory, or a larger --tol."
        raise MachineError(_memory_message(unknowns, machine_bytes, hint))


def _memory_message(unknowns: int, limit: float, hint: str) -> str:
    """Return the error message for a factorisation that needs more memory than `limit` [byte]."""
    needed = factor_bytes(unknowns) / 2**30
    return (
        f"linear solve: memory for {unknowns} unknowns = {needed:.3g} GiB must be at most {limit / 2**30:.3g} GiB. "
        f"{hint}"
    )


def _singular(error: Exception | str) -> str:
    """Return the error message for a matrix that is singular for the reason `error`."""
    return f"linear solve: {error}; the matrix must be positive definite. Clamp the part so that it cannot move freely."

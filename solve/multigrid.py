"""Conjugate gradients for quadratic tetrahedra, preconditioned by linear ones on the same corners.

Direct factors of tetrahedra have many nonzeros: see the curve of error against cost in docs/your-own-part.md.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags, eye, kron, vstack
from scipy.sparse.linalg import LinearOperator, cg, eigsh
from skfem import CellBasis

from sensor.arrays import Floats, Ints
from solve.linear import Factor, SolveError, factorise

_TOLERANCE = 1e-8
_MOST_STEPS = 300
_SMOOTHING = 4  # steps of Chebyshev's iteration before and after the coarse solve
_LOWEST = 0.08  # lowest smoothed eigenvalue over the largest; lower ones are left to the coarse solve
_LARGEST = 1.1  # bound of the largest eigenvalue over its estimate


@dataclass(frozen=True, eq=False)
class TwoGrid:
    """A stiffness matrix of quadratic tetrahedra with some dofs held, and its two-grid preconditioner."""

    block: csr_matrix
    free: Ints
    prolongation: csr_matrix
    coarse: Factor
    diagonal: Floats
    largest: float

    def solve(self, load: Floats) -> Floats:
        """Return displacements (dofs, loads) under loads; raises SolveError if the iteration does not converge."""
        operator = LinearOperator(self.block.shape, matvec=self._cycle, dtype=np.float64)
        u = np.zeros_like(load)
        for column in range(load.shape[1]):
            found, steps = cg(
                self.block, load[self.free, column], rtol=_TOLERANCE, atol=0.0, maxiter=_MOST_STEPS, M=operator
            )
            if steps:  # cg returns the number of steps if it did not converge, else 0
                msg = f"conjugate gradients: no convergence in {steps} steps; check the mesh and what holds the part"
                raise SolveError(msg)
            u[self.free, column] = found
        return u

    def _cycle(self, residual: Floats) -> Floats:
        x = self._smoothed(residual, np.zeros_like(residual))
        rest = self.prolongation.T @ (residual - self.block @ x)
        x = x + self.prolongation @ self.coarse.back_substitute(rest)
        return self._smoothed(residual, x)

    def _smoothed(self, right: Floats, x: Floats) -> Floats:
        """Return x after `_SMOOTHING` steps of Chebyshev's iteration; Y. Saad, Iterative Methods (2003), 12.1."""
        high, low = _LARGEST * self.largest, _LOWEST * self.largest
        theta, delta = 0.5 * (high + low), 0.5 * (high - low)
        sigma = theta / delta
        rho = 1.0 / sigma
        rest = (right - self.block @ x if x.any() else right) / self.diagonal
        step = rest / theta
        for _ in range(_SMOOTHING - 1):
            x = x + step
            rest = rest - (self.block @ step) / self.diagonal
            new = 1.0 / (2.0 * sigma - rho)
            step = new * rho * step + 2.0 * new / delta * rest
            rho = new
        return x + step


def two_grid(basis: CellBasis, matrix: csc_matrix, held: Ints) -> TwoGrid:
    """Return the solver for a matrix of quadratic tetrahedra with held dofs (n,); raises SolveError.

    The coarse space has linear functions on the corners. At the middle of an edge such a function is the mean of its
    ends, which gives the prolongation. The coarse matrix is the Galerkin product of the fine one.
    """
    mesh = basis.mesh
    corners = int(mesh.t.max()) + 1
    edges = mesh.edges
    rows = np.repeat(np.arange(edges.shape[1]), 2)
    half = csr_matrix((np.full(2 * edges.shape[1], 0.5), (rows, edges.T.ravel())), shape=(edges.shape[1], corners))
    to_nodes = csr_matrix(vstack([eye(corners, format="csr"), half]))
    nodes = csr_matrix(kron(to_nodes, csr_matrix(np.eye(3))))
    free = np.setdiff1d(np.arange(matrix.shape[0]), held, assume_unique=False)
    block = csr_matrix(matrix[:, free][free])
    coarse_free = np.setdiff1d(np.arange(3 * corners), held)
    prolongation = csr_matrix(nodes[:, coarse_free][free])
    coarse = factorise(csc_matrix(prolongation.T @ block @ prolongation), np.zeros(0, dtype=np.int64))
    # The factor has its own order of the dofs; this one takes and returns vectors in the order of the corners.
    in_corner_order = Factor(
        coarse.matrix,
        coarse.block,
        coarse.free,
        coarse.fixed,
        lambda right: coarse.back_substitute(right[coarse.free])[np.argsort(coarse.free)],
    )
    diagonal = block.diagonal()
    scaled = diags(diagonal**-0.5) @ block @ diags(diagonal**-0.5)
    largest = float(eigsh(scaled, k=1, tol=1e-2, return_eigenvectors=False, v0=np.ones(len(free)))[0])
    return TwoGrid(block, free, prolongation, in_corner_order, diagonal, largest)

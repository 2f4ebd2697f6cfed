"""Conjugate gradients for quadratic tetrahedra, preconditioned by linear elements on the same mesh (two-grid method).

Factorising the matrix of quadratic tetrahedra would cost much more: docs/your-own-part.md shows the error as a function
of the cost.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags, eye, kron, vstack
from scipy.sparse.linalg import LinearOperator, cg, eigsh
from skfem import CellBasis, Mesh

from sensor.arrays import Floats, Ints
from solve.linear import Factor, SolveError, factorise

_TOLERANCE = 1e-8  # residual, relative to the norm of the load, at which the iteration stops
_MAX_STEPS = 300  # maximum number of iterations
_SMOOTHING_STEPS = 4  # number of Chebyshev iterations before and after the coarse solve
_SMOOTHED_RATIO = 0.08  # ratio of the smallest smoothed eigenvalue to the largest; the coarse solve handles the rest
_EIGENVALUE_MARGIN = 1.1  # upper bound of the largest eigenvalue divided by its estimate


@dataclass(frozen=True, eq=False)
class TwoGrid:
    """The stiffness matrix of quadratic tetrahedra with some dofs held at 0, and its two-grid preconditioner.

    `block` is the submatrix for the dofs `free`, and `diagonal` is its diagonal. `prolongation` interpolates the
    displacements of linear elements to the free dofs. `coarse` is the factorised matrix of the linear elements.
    `largest` is an estimate of the largest eigenvalue of `block` scaled by its diagonal.
    """

    block: csr_matrix
    free: Ints
    prolongation: csr_matrix
    coarse: Factor
    diagonal: Floats
    largest: float

    def solve(self, load: Floats) -> Floats:
        """Return the displacements (dofs, loads) [mm] under the forces `load` (dofs, loads) [N].

        The held dofs have displacements of 0. Each load is solved by conjugate gradients, preconditioned by the
        two-grid cycle. Raises SolveError if the iteration does not converge.
        """
        preconditioner = LinearOperator(self.block.shape, matvec=self._precondition, dtype=np.float64)
        u = np.zeros_like(load)
        for column in range(load.shape[1]):
            solution, status = cg(
                self.block, load[self.free, column], rtol=_TOLERANCE, atol=0.0, maxiter=_MAX_STEPS, M=preconditioner
            )
            if status != 0:  # SciPy returns 0 after convergence, and the number of iterations otherwise
                msg = f"conjugate gradients did not converge in {status} steps. Check the mesh and what holds the part."
                raise SolveError(msg)
            u[self.free, column] = solution
        return u

    def _precondition(self, right_side: Floats) -> Floats:
        """Solve block x = right_side approximately by one two-grid cycle: smoothing, coarse correction, smoothing."""
        x = self._smooth(right_side, np.zeros_like(right_side))
        coarse_residual = self.prolongation.T @ (right_side - self.block @ x)
        x = x + self.prolongation @ self.coarse.back_substitute(coarse_residual)
        return self._smooth(right_side, x)

    def _smooth(self, right_side: Floats, x: Floats) -> Floats:
        """Improve an approximate solution x of block x = right_side by a few Chebyshev iterations, and return it.

        `right_side` and x have the shape (free,). The matrix is scaled by its diagonal. The iteration reduces the error
        in the upper part of the spectrum, where the coarse solve does not help. The names of the variables are taken
        from Y. Saad, Iterative Methods for Sparse Linear Systems (2003), section 12.1.
        """
        high = _EIGENVALUE_MARGIN * self.largest  # upper end of the smoothed part of the spectrum
        low = _SMOOTHED_RATIO * self.largest  # lower end of this part
        theta = 0.5 * (high + low)  # its centre
        delta = 0.5 * (high - low)  # its half width
        sigma = theta / delta
        rho = 1.0 / sigma
        # For x = 0, the residual is the right-hand side, which saves one product with the matrix.
        unscaled_residual = right_side - self.block @ x if x.any() else right_side
        residual = unscaled_residual / self.diagonal
        step = residual / theta
        for _ in range(_SMOOTHING_STEPS - 1):
            x = x + step
            residual = residual - (self.block @ step) / self.diagonal
            next_rho = 1.0 / (2.0 * sigma - rho)
            step = next_rho * rho * step + 2.0 * next_rho / delta * residual
            rho = next_rho
        return x + step


def two_grid(basis: CellBasis, matrix: csc_matrix, held: Ints) -> TwoGrid:
    """Return the two-grid solver for a stiffness matrix of quadratic tetrahedra, with the dofs `held` (n,) at 0.

    `basis` holds the displacements of the tetrahedra, and `matrix` [N/mm] is their stiffness matrix A before any dof is
    held. The coarse space consists of the piecewise linear functions on the same mesh. At the midpoint of an edge, such
    a function is the mean of its values at the two ends. This interpolation defines the prolongation P, and the coarse
    matrix is the Galerkin product P^T A P of the fine matrix A. Raises SolveError if the coarse matrix is singular or
    too large to factorise.
    """
    corner_to_node = _corner_interpolation(basis.mesh)
    free = np.setdiff1d(np.arange(matrix.shape[0]), held)
    block = csr_matrix(matrix[:, free][free])
    # The dofs of the corners come first, so the coarse dofs have the same numbers in the fine matrix.
    coarse_free = np.setdiff1d(np.arange(corner_to_node.shape[1]), held)
    prolongation = csr_matrix(corner_to_node[:, coarse_free][free])
    diagonal = block.diagonal()
    return TwoGrid(
        block=block,
        free=free,
        prolongation=prolongation,
        coarse=_factorise_in_order(csc_matrix(prolongation.T @ block @ prolongation)),
        diagonal=diagonal,
        largest=_largest_eigenvalue(block, diagonal),
    )


def _factorise_in_order(matrix: csc_matrix) -> Factor:
    """Factorise a matrix without fixed dofs, so that `back_substitute` keeps the order of its rows.

    `factorise` reorders the unknowns, so right-hand sides and solutions are converted between the two orders. Raises
    SolveError if the matrix is singular or too large.
    """
    factor = factorise(matrix, np.zeros(0, dtype=np.int64))
    position_in_factor = np.argsort(factor.free)

    def back_substitute(right_side: Floats) -> Floats:
        """Apply the inverse of the matrix to a vector in the order of the rows."""
        return factor.back_substitute(right_side[factor.free])[position_in_factor]

    return replace(factor, back_substitute=back_substitute)


def _largest_eigenvalue(block: csr_matrix, diagonal: Floats) -> float:
    """Return the largest eigenvalue of a matrix scaled by its diagonal [1], to about 1 %.

    The start vector of the Lanczos iteration is fixed, so that repeated runs give the same digits.
    """
    scaled = diags(diagonal**-0.5) @ block @ diags(diagonal**-0.5)
    eigenvalues = eigsh(scaled, k=1, tol=1e-2, return_eigenvectors=False, v0=np.ones(len(diagonal)))
    return float(eigenvalues[0])


def _corner_interpolation(mesh: Mesh) -> csr_matrix:
    """Return the matrix that interpolates displacements at the corners to all nodes, shape (dofs, 3 corners).

    The nodes are the corners, followed by the midpoints of the edges. The displacement of a midpoint is the mean of the
    displacements at the two ends of its edge.
    """
    corner_count = int(mesh.t.max()) + 1
    edges = mesh.edges
    edge_count = edges.shape[1]
    rows = np.repeat(np.arange(edge_count), 2)  # each edge has two entries of 0.5, one for each of its ends
    to_midpoints = csr_matrix((np.full(2 * edge_count, 0.5), (rows, edges.T.ravel())), shape=(edge_count, corner_count))
    to_nodes = csr_matrix(vstack([eye(corner_count, format="csr"), to_midpoints]))
    return csr_matrix(kron(to_nodes, csr_matrix(np.eye(3))))  # the same for each of the three components

"""The direct solver for peers without one: SciPy's SuperLU, with the settings of the product's own direct solver."""

import numpy as np
from scipy.sparse.linalg import splu


class StiffnessSolver:
    """A symmetric stiffness matrix (dofs, dofs) [N/mm]; it is factorised again only if other dofs are prescribed."""

    def __init__(self, K):
        """Take the matrix of all dofs."""
        self.K = K
        self._free = None

    def displacements(self, prescribed, values, loads):
        """Return the displacements (dofs,) [mm] under `loads` (dofs,) [N], with `values` [mm] at `prescribed` dofs.

        The factor of the matrix is stored for the next call with the same dofs.
        """
        u = np.zeros(self.K.shape[0])
        u[prescribed] = values
        free = np.setdiff1d(np.arange(len(u)), prescribed)
        if self._free is None or not np.array_equal(free, self._free):
            self._factor = _factor(self.K[free][:, free].tocsc())
            self._free = free
        u[free] = self._factor.solve((loads - self.K @ u)[free])
        return u


def _factor(block):
    """Return SuperLU's factor of a symmetric matrix: minimum-degree ordering of A + A^T, pivots on the diagonal."""
    return splu(block, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

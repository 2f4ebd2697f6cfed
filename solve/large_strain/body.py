"""Energy, forces and tangent of a round body at finite strain: quadratic elements with a linear pressure in each.

The logarithm of the volume enters the energy by its projection on linear functions within each element, which keeps
elements from locking as nu nears 0.5: the Q2 / P1 pair with its pressure condensed, Boffi, Brezzi, Fortin, Mixed Finite
Element Methods (2013), chapter 8, doi:10.1007/978-3-642-36519-5.
"""

import math

import numpy as np

from solve.arrays import Floats, Ints
from solve.large_strain.elements import quadratic_elements
from solve.large_strain.flesh_law import FleshLaw
from solve.large_strain.grid import Grid
from solve.large_strain.stretch import STRETCH_MODES, mode_stiffness, principal_modes, principal_stretches

_NO_STRAIN = np.array([1.0, 0.0, 0.0, 1.0, 1.0])


class RoundBody:
    """The elements of a grid with a law of flesh; displacements are (nodes, 2), radial and up [tip sides]."""

    def __init__(self, grid: Grid, law: FleshLaw) -> None:
        """Set up the gradients and weights of all elements."""
        self.law = law
        self.nodes: Ints = grid.nodes
        self.count = len(grid.r_nodes) * len(grid.z_nodes)
        self.dofs: Ints = (2 * self.nodes[:, :, None] + np.arange(2)).reshape(len(self.nodes), -1)
        self._elements = quadratic_elements(grid)

    @property
    def volume(self) -> float:
        """Return the volume of the body without load [tip sides^3]."""
        return float(self._elements.weights.sum())

    def energy(self, u: Floats) -> float:
        """Return the strain energy [E times tip side^3]; infinity where the body is turned inside out."""
        stretches = principal_stretches(self._deformation(u))
        if not stretches.min() > 0.0:
            return math.inf
        of_volume = self.law.of_volume(self._log_volume(stretches))[0]
        density = self.law.of_stretch(stretches)[0].sum(axis=2) + of_volume
        return float((self._elements.weights * density).sum())

    def tangent(self, u: Floats, *, projected: bool = False) -> tuple[Floats, Floats]:
        """Return the forces that hold u, (2 nodes,) [E times tip side^2], and the matrix of each element.

        Matrices have shape (elements, 18, 18) [E times tip side]. With `projected` negative curvatures of the energy
        at the points are left out, so that no matrix is indefinite.
        """
        F = self._deformation(u)
        stretches, weights = principal_stretches(F), self._elements.weights
        _, slope, curvature = self.law.of_stretch(stretches)
        _, volume_slope, bulk = self.law.of_volume(self._log_volume(stretches))
        pressure = self._projected(volume_slope)
        stiffness = mode_stiffness(stretches, slope, curvature, pressure)
        stiffness = np.maximum(stiffness, 0.0) if projected else stiffness
        B = principal_modes(F) @ self._elements.operator  # (elements, points, modes, 18)
        along = B[:, :, list(STRETCH_MODES)]
        stress = slope + pressure[..., None] / stretches
        forces = self.assembled(np.einsum("eq,eqs,eqsd->ed", weights, stress, along))
        growth = self._elements.projection @ np.einsum("eqs,eqsd->eqd", 1.0 / stretches, along)
        return forces, _weighted_squares(B, weights[..., None] * stiffness) + _weighted_squares(growth, weights * bulk)

    def assembled(self, local: Floats) -> Floats:
        """Return the sum over elements of their vectors (elements, 18), shape (2 nodes,) [their unit]."""
        return np.bincount(self.dofs.ravel(), local.ravel(), minlength=2 * self.count).astype(np.float64)

    def _deformation(self, u: Floats) -> Floats:
        """Return F at all points, shape (elements, points, 5) [1]."""
        local = u[self.nodes].reshape(len(self.nodes), 1, -1, 1)
        return np.asarray((self._elements.operator @ local)[..., 0] + _NO_STRAIN)

    def _log_volume(self, stretches: Floats) -> Floats:
        return self._projected(np.log(stretches.prod(axis=2)))

    def _projected(self, values: Floats) -> Floats:
        """Return values at all points (elements, points) by the linear functions nearest to them [same unit]."""
        return np.asarray((self._elements.projection @ values[..., None])[..., 0])


def _weighted_squares(rows: Floats, weights: Floats) -> Floats:
    """Return the sum of row^T weight row in each element (elements, n, n); rows (elements, ..., n)."""
    elements, size = len(rows), rows.shape[-1]
    flat = rows.reshape(elements, -1, size)
    return np.asarray(flat.transpose(0, 2, 1) @ (weights.reshape(elements, -1, 1) * flat))

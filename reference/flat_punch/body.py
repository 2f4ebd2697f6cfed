"""Energy, forces and tangent of a round body at finite strain: quadratic elements with a linear pressure in each.

The logarithm of the volume enters the energy by its projection on linear functions within each element. This keeps
elements from locking as nu nears 0.5. It is the Q2 / P1 pair with its pressure condensed, Boffi, Brezzi, Fortin, Mixed
Finite Element Methods (2013), chapter 8, doi:10.1007/978-3-642-36519-5.
"""

import math
from dataclasses import dataclass

import numpy as np

from reference.flat_punch.elements import COLUMNS, DOFS, PAIRS, ROWS, quadratic_elements
from reference.flat_punch.grid import Grid
from sensor.arrays import Floats, Ints
from solve.compression.flesh_law import FleshLaw
from solve.compression.stretch import mode_stiffness, principal_modes, principal_stretches

_REST = np.array([1.0, 0.0, 0.0, 1.0, 1.0])[:, None, None]  # F without displacement


@dataclass(frozen=True, kw_only=True, eq=False)
class Deformed:
    """A body at displacements u (nodes, 2) [tip sides]: F (5, points, elements) [1] and its principal stretches.

    `theta` (points, elements) [1] is the projected logarithm of the volume, `energy` [E times tip side^3] that of the
    strain. Where the body is turned inside out, the energy is infinite and theta 0.
    """

    u: Floats
    F: Floats
    stretches: Floats
    theta: Floats
    energy: float


class RoundBody:
    """The elements of a grid with a law of flesh; displacements are (nodes, 2), radial and up [tip sides]."""

    def __init__(self, grid: Grid, law: FleshLaw) -> None:
        """Set up the shape functions and weights of all elements."""
        self.law = law
        self.count = len(grid.r_nodes) * len(grid.z_nodes)
        self.dofs: Ints = (2 * grid.nodes[:, :, None] + np.arange(2)).reshape(len(grid.nodes), DOFS).T.copy()
        self._elements = quadratic_elements(grid)
        self._gradient = self._elements.gradient.reshape(-1, DOFS)
        self._weighted_pressures = self._elements.weights * self._elements.pressures

    @property
    def volume(self) -> float:
        """Return the volume of the body without load [tip sides^3]."""
        return float(self._elements.weights.sum())

    def deformed(self, u: Floats) -> Deformed:
        """Return the strain and its energy at displacements (nodes, 2) [tip sides]."""
        scale = self._elements.scale
        F = (self._gradient @ u.ravel()[self.dofs]).reshape(scale.shape) * scale + _REST
        stretches = principal_stretches(F)
        if not stretches.min() > 0.0:
            return Deformed(u=u, F=F, stretches=stretches, theta=np.zeros_like(F[0]), energy=math.inf)
        theta = self._projected(np.log(stretches.prod(axis=0)))
        density = self.law.phi(stretches)[0].sum(axis=0) + self.law.U(theta)[0]
        energy = float((self._elements.weights * density).sum())
        return Deformed(u=u, F=F, stretches=stretches, theta=theta, energy=energy)

    def tangent(self, body: Deformed, *, projected: bool = False) -> tuple[Floats, Floats]:
        """Return the forces that hold a body, (2 nodes,) [E times tip side^2], and the matrix of each element.

        Of symmetric matrices the entries on and below the diagonal are returned, (171, elements) [E times tip side].
        With `projected` negative curvatures of the energy at the points are left out, so that none is indefinite.
        """
        elements = self._elements
        scale = elements.scale
        _, slope, curvature = self.law.phi(body.stretches)
        _, volume_slope, bulk = self.law.U(body.theta)
        pressure = self._projected(volume_slope)
        modes = principal_modes(body.F)

        # Second derivatives of phi + p ln J, diagonal in the modes, by pairs of parts of F.
        stiffness = mode_stiffness(body.stretches, slope, curvature, pressure)
        if projected:
            stiffness = np.maximum(stiffness, 0.0)
        stiffness = elements.weights * stiffness
        weighted_modes = modes * stiffness[:4, None]
        by_pairs = []
        for i, j in PAIRS[:-1]:
            by_pairs.append((weighted_modes[:, i] * modes[:, j]).sum(axis=0) * scale[i] * scale[j])
        by_pairs.append(stiffness[4] * scale[4] ** 2)
        matrix = elements.squares @ np.concatenate(by_pairs)

        # The curvature of U, by the growth of volume that each pressure function sees.
        growth = _by_parts(modes, 1.0 / body.stretches)
        seen = np.stack([self._nodal_forces(function * growth) for function in self._weighted_pressures])
        weighted_bulk = elements.weights * bulk
        coupling = np.einsum("kqe,lqe->kle", weighted_bulk * elements.pressures, elements.pressures, optimize=False)
        bulk_forces = np.einsum("kle,lde->kde", coupling, seen)
        of_volume = sum(left[ROWS] * right[COLUMNS] for left, right in zip(bulk_forces, seen, strict=True))
        matrix += np.asarray(of_volume)

        stress = _by_parts(modes, slope + pressure / body.stretches)
        return self.assembled(self._nodal_forces(elements.weights * stress)), matrix

    def assembled(self, local: Floats) -> Floats:
        """Return the sum over elements of their vectors (18, elements), shape (2 nodes,) [their unit]."""
        total = np.bincount(self.dofs.ravel(), local.ravel(), minlength=2 * self.count)
        return total.astype(np.float64, copy=False)

    def _nodal_forces(self, stress: Floats) -> Floats:
        """Return the forces (18, elements) of stresses conjugate to F times their volumes (5, points, elements)."""
        return self._gradient.T @ (self._elements.scale * stress).reshape(len(self._gradient), -1)

    def _projected(self, values: Floats) -> Floats:
        """Return values at all points (points, elements) by the linear functions nearest to them [same unit]."""
        coefficients = (self._weighted_pressures * values).sum(axis=1)
        return np.asarray((self._elements.pressures * coefficients[:, None]).sum(axis=0))


def whole_matrices(entries: Floats) -> Floats:
    """Return the matrices (elements, 18, 18) of their entries on and below the diagonal (171, elements) [same unit]."""
    whole = np.empty((entries.shape[1], DOFS, DOFS))
    whole[:, ROWS, COLUMNS] = entries.T
    whole[:, COLUMNS, ROWS] = entries.T
    return whole


def _by_parts(modes: Floats, principal: Floats) -> Floats:
    """Return slopes along the principal stretches (3, ...) as slopes along the parts of F, shape (5, ...)."""
    in_plane = principal[0] * modes[0] + principal[1] * modes[1]
    return np.concatenate([in_plane, principal[2:]])

"""Displacement, stress and strain at the nodes of a mesh, for viewing."""

from dataclasses import dataclass

import numpy as np

from solve.arrays import Floats
from solve.elasticity import von_mises


@dataclass(frozen=True, kw_only=True, eq=False)
class NodalFields:
    """Displacement [mm], shape (nodes, 3), stress [MPa] and strain [1], both (3, 3, nodes)."""

    displacement: Floats
    stress: Floats
    strain: Floats

    @property
    def von_mises(self) -> Floats:
        """Return the equivalent stress [MPa], shape (nodes,)."""
        return von_mises(self.stress)

    @property
    def largest_principal_strain(self) -> Floats:
        """Return the principal strain that is largest in size, without its sign [1], shape (nodes,)."""
        principal = np.linalg.eigvalsh(self.strain.transpose(2, 0, 1))
        return np.asarray(np.abs(principal).max(axis=1))

"""The largest strain on the leaves of a spring, at their roots."""

import numpy as np
from skfem import CellBasis

from solve.arrays import Floats
from solve.housing.clamped_half import POINTS, WEIGHTS
from solve.surface import surface_patches

# Values at two Gauss points of an edge, continued in a straight line to its ends.
_CONTINUED = 0.5 * np.array([[1.0 + np.sqrt(3.0), 1.0 - np.sqrt(3.0)], [1.0 - np.sqrt(3.0), 1.0 + np.sqrt(3.0)]])


def largest_strain(basis: CellBasis, name: str, u: Floats) -> tuple[float, float]:
    """Return the largest principal strain [1] in size on a surface: carried on to its facets' corners, and inside.

    Strain is best at the Gauss points; its peak lies between them, so it is continued bilinearly.
    """
    largest = np.zeros(2)
    for patch in surface_patches(basis, name, POINTS, WEIGHTS):
        gradient = np.einsum("nie,njep->epij", u[patch.dofs], patch.gradients)
        inside = 0.5 * (gradient + gradient.swapaxes(2, 3))
        corners = np.einsum("qp,epij->eqij", np.kron(_CONTINUED, _CONTINUED), inside)
        sizes = [np.abs(np.linalg.eigvalsh(strain)).max() for strain in (corners, inside)]
        largest = np.maximum(largest, sizes)
    return float(largest[0]), float(largest[1])

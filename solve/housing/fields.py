"""Fields of the loaded housing for viewing: displacement at the nodes of its mesh, von Mises stress in its cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from skfem import CellBasis, ElementHex2, ElementHexS2, ElementVector, Mesh

from solve.arrays import Floats
from solve.elasticity import stress, vector_basis, von_mises
from solve.housing.held_half import Attached
from solve.housing.stiffness import displacements

_GAUSS = 3  # polynomial degree: 2^3 points, where the strain of these elements is most accurate


@dataclass(frozen=True, kw_only=True)
class FlexureFields:
    """Displacement [mm] at `mesh.doflocs`, shape (points, 3), and von Mises stress [MPa], shape (cells,)."""

    displacement: Floats
    von_mises: Floats


def flexure_fields(
    mesh: Mesh, E: float, poisson: float, forces: Sequence[float], attached: Sequence[Attached] = ()
) -> FlexureFields:
    """Return the fields under a force [N] along the press on each tip, mesh of the half [mm].

    The stress of a cell is the mean over its Gauss points. Raises SolveError as `tip_compliance` does.
    """
    u = displacements(mesh, E, poisson, attached) @ np.array(forces)
    return FlexureFields(displacement=_at_nodes(mesh, u), von_mises=_von_mises(mesh, u, E, poisson))


def _at_nodes(mesh: Mesh, u: Floats) -> Floats:
    """Evaluate 20-node displacements at the 27 nodes a cell of the mesh."""
    places = np.asarray(ElementHex2().doflocs, dtype=np.float64).T
    weights = np.full(places.shape[1], 1.0 / places.shape[1])
    basis = CellBasis(mesh, ElementVector(ElementHexS2()), quadrature=(places, weights))
    values = np.asarray(basis.interpolate(u))  # (3, cells, 27)
    found = np.empty((mesh.doflocs.shape[1], 3))
    found[mesh.dofs.element_dofs] = values.transpose(2, 1, 0)
    return found


def _von_mises(mesh: Mesh, u: Floats, E: float, poisson: float) -> Floats:
    basis = vector_basis(mesh, ElementHexS2(), order=_GAUSS)
    gradient = np.asarray(basis.interpolate(u).grad)
    found: Floats = von_mises(stress(gradient, E, poisson)).mean(axis=1)
    return found

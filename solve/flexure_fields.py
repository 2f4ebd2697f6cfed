"""Fields of the loaded housing for viewing: displacement at the nodes of its mesh, von Mises stress in its cells."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import CellBasis, ElementHex2, ElementHexS2, ElementVector, Mesh

from solve.elasticity import lame_parameters
from solve.flexure import displacements
from solve.fruit_fields import von_mises

Floats = NDArray[np.float64]

_GAUSS = 3  # polynomial degree: 2^3 points, where the strain of these elements is most accurate


@dataclass(frozen=True, kw_only=True)
class FlexureFields:
    """Displacement [mm] at `mesh.doflocs`, shape (points, 3), and von Mises stress [MPa], shape (cells,)."""

    displacement: Floats
    von_mises: Floats


def flexure_fields(mesh: Mesh, E: float, poisson: float, forces: tuple[float, float]) -> FlexureFields:
    """Return the fields under a force [N] along the press on the low and on the high tip, mesh of the half [mm].

    The stress of a cell is the mean over its Gauss points. Raises SolveError as `tip_compliance` does.
    """
    u = displacements(mesh, E, poisson) @ np.array(forces)
    return FlexureFields(displacement=_at_nodes(mesh, u), von_mises=_von_mises(mesh, u, E, poisson))


def _at_nodes(mesh: Mesh, u: Floats) -> Floats:
    """Evaluate 20-node displacements at the 27 nodes a cell of the mesh."""
    places = np.asarray(ElementHex2().doflocs, dtype=np.float64).T
    basis = _basis(mesh, places)
    values = np.asarray(basis.interpolate(u))  # (3, cells, 27)
    found = np.empty((mesh.doflocs.shape[1], 3))
    found[mesh.dofs.element_dofs] = values.transpose(2, 1, 0)
    return found


def _von_mises(mesh: Mesh, u: Floats, E: float, poisson: float) -> Floats:
    basis = CellBasis(mesh, ElementVector(ElementHexS2()), intorder=_GAUSS)
    gradient = np.asarray(basis.interpolate(u).grad)
    strain = 0.5 * (gradient + gradient.transpose(1, 0, 2, 3))
    lam, mu = lame_parameters(E, poisson)
    stress = 2.0 * mu * strain + lam * np.einsum("iiep->ep", strain) * np.eye(3)[:, :, None, None]
    found: Floats = von_mises(stress).mean(axis=1)
    return found


def _basis(mesh: Mesh, places: Floats) -> CellBasis:
    weights = np.full(places.shape[1], 1.0 / places.shape[1])
    return CellBasis(mesh, ElementVector(ElementHexS2()), quadrature=(places, weights))

"""Fields of the loaded housing for viewing, at the nodes of its 20-node hexahedra."""

from collections.abc import Sequence

import numpy as np
from skfem import ElementHexS2, Mesh

from solve.arrays import Floats, Ints
from solve.elasticity import stress, vector_basis
from solve.housing.clamped_half import REDUCED, Attached
from solve.housing.nodal_strain import nodal_strain
from solve.housing.stiffness import SPRINGS, displacements, leaf_faces
from solve.nodal_fields import NodalFields

_FREE = "free"


def flexure_fields(
    mesh: Mesh, E: float, poisson: float, forces: Sequence[float], attached: Sequence[Attached] = ()
) -> NodalFields:
    """Return the fields under a force [N] along the press on each tip, mesh of the half y >= 0 [mm], E [MPa].

    Raises SolveError as `tip_compliance` does.
    """
    return fields_of(mesh, E, poisson, displacements(mesh, E, poisson, attached) @ np.array(forces))


def fields_of(mesh: Mesh, E: float, poisson: float, u: Floats) -> NodalFields:
    """Return the fields of displacements u [mm] of 20-node cells, shape (dofs,), E [MPa].

    The nodes are the first of `mesh.doflocs`: corners, then the middles of edges. Named boundaries other than leaves
    carry a load or a support; the surface of the rest is taken to carry none, where foils are glued on too.
    """
    basis = vector_basis(mesh.with_boundaries({_FREE: _free_facets(mesh)}), ElementHexS2(), order=REDUCED)
    strain = nodal_strain(basis, u, poisson, _FREE)
    displacement = u[np.hstack([basis.nodal_dofs, basis.edge_dofs]).T]
    # `stress` takes a gradient; of a strain, its own symmetric part, it is the same
    return NodalFields(displacement=displacement, stress=stress(strain, E, poisson), strain=strain)


def _free_facets(mesh: Mesh) -> Ints:
    leaves = [leaf_faces(spring) for spring in SPRINGS]
    loaded = [facets for name, facets in (mesh.boundaries or {}).items() if name not in leaves]
    found: Ints = np.setdiff1d(mesh.boundary_facets(), np.concatenate(loaded))
    return found


def most_strained_node(mesh: Mesh, surface: str, fields: NodalFields) -> int:
    """Return the node on a named surface at which the principal strain is largest in size."""
    dofs = mesh.dofs.get_facet_dofs((mesh.boundaries or {})[surface])
    nodes: Ints = np.unique(np.concatenate([dofs.nodal["u"], dofs.edge["u"]]))
    return int(nodes[fields.largest_principal_strain[nodes].argmax()])

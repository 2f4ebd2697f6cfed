"""The stiffness of both flexures with different finite elements, to compare the product's element with alternatives.

The assembly and the linear solver belong to the product. The elements, the integration and the loads do not.
"""

from dataclasses import dataclass

import numpy as np
from skfem import (
    CellBasis,
    ElementHex1,
    ElementHex2,
    ElementHexS2,
    ElementTetP1,
    ElementTetP2,
    FacetBasis,
    Mesh,
)

from sensor.arrays import Floats
from sensor.quantity import validation_error
from solve.elasticity import stiffness_matrix, vector_basis
from solve.housing.stiffness import SPRINGS, tip_face, tip_stiffnesses
from solve.linear import factorise

# Each element is listed with the polynomial degree up to which its quadrature is exact. In a hexahedron, degree 3 means
# 2^3 Gauss points, and degree 5 means 3^3.
CHOICES = {
    "hex 20, reduced": (ElementHexS2, 3),
    "hex 20, full": (ElementHexS2, 5),
    "hex 27, full": (ElementHex2, 5),
    "hex 8": (ElementHex1, 3),
    "tet P1": (ElementTetP1, 1),
    "tet P2": (ElementTetP2, 2),
}


@dataclass(frozen=True, kw_only=True)
class ElementStiffness:
    """The stiffness of each tip, `K` [N/mm], with one kind of element on one mesh, and the number of dofs."""

    K: tuple[float, ...]
    dofs: int


def element_stiffness(mesh: Mesh, choice: str, E: float, poisson: float) -> ElementStiffness:
    """Return the stiffness of each tip of a housing [N/mm] with the element `choice` of `CHOICES`.

    `mesh` [mm] is the whole housing, or half of it with a boundary `symmetry`. Its mounting holes are clamped. E is in
    MPa. Raises InputError for an unknown element, and SolveError if the solution is not accurate.
    """
    basis = element_basis(mesh, choice)
    is_half = "symmetry" in (mesh.boundaries or {})
    held_dofs = basis.get_dofs("mounting_holes").all()
    if is_half:
        held_dofs = np.union1d(held_dofs, basis.get_dofs("symmetry").all("u^2"))
    factor = factorise(stiffness_matrix(basis, E, poisson), held_dofs)
    mean_vectors = np.column_stack([face_mean(basis, tip_face(spring)) for spring in SPRINGS])
    # Each vector is also a load of 1 N. On half of a tip, it corresponds to 2 N on the whole tip.
    C = (0.5 if is_half else 1.0) * (mean_vectors.T @ factor.solve(mean_vectors))
    return ElementStiffness(K=tip_stiffnesses(C), dofs=int(basis.N))


def element_basis(mesh: Mesh, choice: str) -> CellBasis:
    """Return the displacement basis of an element in `CHOICES` on a mesh. Raises InputError for an unknown element."""
    if choice not in CHOICES:
        raise validation_error("element", choice, "", f"one of {', '.join(CHOICES)}", "choose one of these")
    element, order = CHOICES[choice]
    return vector_basis(mesh, element(), order)


def face_mean(basis: CellBasis, name: str) -> Floats:
    """Return the vector (dofs,) whose scalar product with the displacements is the mean of u_z over a face.

    This vector is also the nodal load of 1 N that is distributed uniformly over the face.
    """
    face = FacetBasis(basis.mesh, basis.elem, facets=basis.mesh.boundaries[name], intorder=4)
    integrals = np.zeros(basis.N)
    # Each shape function of an element has one dof per facet, and its values at the quadrature points.
    for dofs, field in zip(face.element_dofs, face.basis, strict=True):
        u_z = np.asarray(field[0])[2]
        np.add.at(integrals, dofs, (u_z * face.dx).sum(axis=-1))
    return integrals / float(face.dx.sum())

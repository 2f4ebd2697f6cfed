"""A faster version of scikit-fem's basis for displacements, which computes data only when they are first used."""

import functools

import numpy as np
from skfem import CellBasis, Element, ElementVector, Mesh
from skfem.element import DiscreteField

from mesh.cells import cell_jacobian, cell_points, determinant, gradients, shape_table
from sensor.arrays import Floats, Ints


class DisplacementBasis(CellBasis):  # type: ignore[misc]
    """The finite-element basis of displacements, whose components each have the shape functions of a scalar element."""

    def __init__(self, mesh: Mesh, element: Element, order: int) -> None:
        """Set the numbers of the dofs. `order` is the polynomial degree that the quadrature integrates exactly."""
        # Skip the constructor of CellBasis, because it computes the fields of each vector component separately.
        super(CellBasis, self).__init__(
            mesh, ElementVector(element), intorder=order, refdom=mesh.refdom, disable_doflocs=True
        )
        self.tind = None
        self.nelems = mesh.nelements

    @functools.cached_property
    def basis(self) -> list[tuple[DiscreteField, ...]]:
        """Return each vector shape function at the quadrature points, in the form that scikit-fem's assembly uses."""
        return [self.elem.gbasis(self.mapping, self.X, i) for i in range(self.Nbfun)]

    @functools.cached_property
    def dx(self) -> Floats:
        """Return the quadrature weights [mm^3], shape (elements, points)."""
        return np.asarray(np.abs(determinant(cell_jacobian(self.mesh, self.X))) * self.W)

    @functools.cached_property
    def doflocs(self) -> Floats:
        """Return the positions of the dofs [mm], shape (dim, dofs)."""
        points = np.empty((self.mesh.dim(), self.N))
        points[:, self.element_dofs.T] = cell_points(self.mesh, self.elem.doflocs.T)
        return points


def cell_nodes(basis: CellBasis) -> Ints:
    """Return the node indices of each cell, shape (cells, nodes).

    The dofs of node n are dim * n, dim * n + 1 and so on, one for each component of its displacement.
    """
    dim = basis.mesh.dim()
    return np.asarray(basis.element_dofs[::dim].T // dim)


def scalar_shapes(basis: CellBasis) -> Floats:
    """Return the values of the scalar shape functions at the quadrature points [1], shape (nodes, points)."""
    return shape_table(basis.elem.elem, basis.quadrature[0]).values


def scalar_gradients(basis: CellBasis) -> Floats:
    """Return the gradients of the scalar shape functions at the quadrature points [1/mm].

    The shape is (nodes, dim, elements, points).
    """
    points = basis.quadrature[0]
    return gradients(shape_table(basis.elem.elem, points), cell_jacobian(basis.mesh, points, basis.tind))

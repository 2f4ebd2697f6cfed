"""Finite elements of the upper half of a body that is compressed along z, and the strain energy of the body.

The body is axisymmetric about z, or in plane strain because it is long in the direction normal to its section. The
lower half is the mirror image of the upper half.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix

from sensor.arrays import Flags, Floats, Ints
from solve.compression.flesh_law import FleshLaw
from solve.compression.quadratic import quadratic, quadratic_slope, tensor_product
from solve.compression.stretch import mode_stiffness, principal_modes, principal_stretches

# Gauss points per direction. With three points, quadratic elements lock as nu tends to 0.5. O. C. Zienkiewicz, R. L.
# Taylor, The Finite Element Method (2000), volume 1, section 12.5.
_POINTS = 2
_ELEMENT_DOFS = 18  # dofs of an element with nine nodes
_UNDEFORMED = np.array([1.0, 0.0, 0.0, 1.0, 1.0])  # F_rr, F_rz, F_zr, F_zz and F_tt of the undeformed body
_FIRST_ELEMENT = 0.08  # size of the element on the axis under the plate, divided by the largest contact radius
_EDGE_ELEMENT = 0.03  # size of the elements at the edge of a flat plunger, divided by the radius of the plunger
_GROWTH_FROM_EDGE = 1.6  # size ratio of successive elements away from the edge of a plunger
_GROWTH = 1.2  # size ratio elsewhere; contacts of all sizes then span similar numbers of elements
_LARGEST_ELEMENT = 0.15  # size of the largest element divided by the extent of the section along r or z


@dataclass(frozen=True, kw_only=True)
class Section:
    """The upper half of the section of a body along the direction of compression. Lengths are in mm.

    With `is_round`, the section is an ellipse whose radius of curvature at the top is `radius`. The body is a ball or
    an ellipsoid of revolution or, with a `length`, a cylinder lying on its side. Without `is_round`, the section is a
    rectangle and the body is an upright cylinder of this `radius`. `half_height` is the height of the body above its
    middle plane. With `on_table`, the middle plane is instead the base of the body, and a tool that grips holds the
    nodes of the base too.
    """

    half_height: float
    radius: float
    length: float | None = None
    is_round: bool = True
    on_table: bool = False

    def place(self, across: Floats, up: Floats) -> tuple[Floats, Floats]:
        """Map points of the unit square to the section, and return their coordinates r and z [mm].

        `across` is 0 on the axis and 1 on the side. `up` is 0 on the middle plane and 1 at the top.
        """
        if not self.is_round:
            return self.radius * across, self.half_height * up
        half_width = math.sqrt(self.radius * self.half_height)  # the other semi-axis of the ellipse
        return half_width * across * np.sqrt(1.0 - 0.5 * up**2), self.half_height * up * np.sqrt(1.0 - 0.5 * across**2)


class HalfBody:
    """The finite-element model of the upper half of a body, with the material law of its flesh scaled to E = 1 MPa.

    Displacements (nodes, 2) [mm] are along r and z. `x` (nodes, 2) [mm] are the positions of the nodes of the
    undeformed body. `surface` holds the indices of the nodes that a tool may touch, outwards from the axis. `area`
    [mm^2] is the surface area of each of these nodes. `held` (2 nodes,) marks the dofs that are fixed by symmetry.
    `on_table` holds the indices of the nodes on a table.
    """

    def __init__(
        self, section: Section, law: FleshLaw, contact: float, refinement: float = 1.0, edge: float = math.inf
    ) -> None:
        """Place the nodes, and compute the matrices that map displacements to deformation gradients.

        `section` is the shape of the half section, and `law` the material law of the flesh. `contact` [mm] is the
        approximate radius of the largest contact. `edge` [mm] is the radius of a flat plunger, and infinite for other
        tools. Doubling the `refinement` halves the element size.
        """
        self.law = law
        boundaries_across, boundaries_down = _element_boundaries(section, contact, refinement, edge)
        across = _with_midpoints(boundaries_across)
        up = 1.0 - _with_midpoints(boundaries_down)[::-1]  # from the middle plane to the top
        columns = len(across)
        rows = len(up)
        r, z = section.place(*np.meshgrid(across, up, indexing="ij"))
        self.x = np.stack([r.ravel(), z.ravel()], axis=1)
        self.count = len(self.x)

        # Nodes are numbered upwards in columns, which begin at the axis. Dof 2 i moves node i along r, and dof 2 i + 1
        # moves it along z.
        index = np.arange(self.count).reshape(columns, rows)
        nodes = _element_nodes(index)
        self.dofs: Ints = (2 * nodes[:, :, None] + np.arange(2)).reshape(-1, _ELEMENT_DOFS)
        self.held = _dofs_held_by_symmetry(index)
        self.surface = _surface_nodes(index)
        self.on_table: Ints = index[:, 0] if section.on_table else index[:0, 0]  # empty without a table
        self.area = _nodal_areas(self.x[self.surface], section.length)
        self._strain, self._volumes = _strain_operator(self.x[nodes], section.length)

    @property
    def volume(self) -> float:
        """Return the volume of the half body [mm^3]."""
        return float(self._volumes.sum())

    def deformed(self, u: Floats) -> "Deformed":
        """Return the deformed body with its strain energy, for displacements u (nodes, 2) [mm]."""
        F = np.einsum("eqid,ed->ieq", self._strain, u.ravel()[self.dofs], optimize=True)
        F = F + _UNDEFORMED[:, None, None]
        stretches = principal_stretches(F)
        if not stretches.min() > 0.0:  # an element is inverted
            return Deformed(u=u, F=F, stretches=stretches, energy=math.inf)
        phi, _, _ = self.law.phi(stretches)
        U, _, _ = self.law.U(np.log(stretches.prod(axis=0)))
        density = phi.sum(axis=0) + U
        return Deformed(u=u, F=F, stretches=stretches, energy=float((self._volumes * density).sum()))

    def tangent(self, deformed: "Deformed", *, convex: bool) -> tuple[Floats, csc_matrix]:
        """Return the internal nodal forces (2 nodes,) [N] and the tangent stiffness (2 nodes, 2 nodes) [N/mm].

        Forces and stiffness are the first and second derivatives of the strain energy with respect to the
        displacements, in the state `deformed`. With `convex`, negative stiffnesses of the modes at the Gauss points are
        set to 0. The matrix is then positive semidefinite, so that a Newton step lowers the energy.
        """
        stress, moduli = self._stress_and_moduli(deformed, convex=convex)
        # Integrate over the elements. The indices are element e, Gauss point q, components i and j of F, dofs d and f.
        element_matrices = np.einsum(
            "eqid,ijeq,eqjf->edf", self._strain, self._volumes * moduli, self._strain, optimize=True
        )
        element_forces = np.einsum("ieq,eqid->ed", self._volumes * stress, self._strain, optimize=True)
        # Assemble the elements. Entries with the same row and column are added.
        size = 2 * self.count
        rows = np.repeat(self.dofs, _ELEMENT_DOFS, axis=1)
        columns = np.tile(self.dofs, (1, _ELEMENT_DOFS))
        matrix = csc_matrix((element_matrices.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
        forces = np.bincount(self.dofs.ravel(), element_forces.ravel(), minlength=size)
        return forces.astype(np.float64, copy=False), matrix

    def _stress_and_moduli(self, deformed: "Deformed", *, convex: bool) -> tuple[Floats, Floats]:
        """Return the first and second derivatives of the energy density with respect to the five components of F [MPa].

        The first derivatives are the first Piola-Kirchhoff stress (5, elements, points). The second ones are the moduli
        (5, 5, elements, points). With `convex`, negative stiffnesses of the modes are set to 0.
        """
        _, slope, curvature = self.law.phi(deformed.stretches)  # derivatives with respect to the stretches
        _, pressure, bulk = self.law.U(np.log(deformed.stretches.prod(axis=0)))  # derivatives with respect to theta
        modes = principal_modes(deformed.F)
        stiffness = mode_stiffness(deformed.stretches, slope, curvature, pressure)
        if convex:
            stiffness = np.maximum(stiffness, 0.0)
        # The outer product is the part of U that is due to its curvature in theta. The modes m contribute all other
        # terms.
        theta_gradient = _apply_chain_rule(modes, 1.0 / deformed.stretches)
        moduli = bulk * theta_gradient[:, None] * theta_gradient[None, :]
        moduli[:4, :4] += np.einsum("meq,mieq,mjeq->ijeq", stiffness[:4], modes, modes, optimize=True)
        moduli[4, 4] += stiffness[4]  # the fifth mode is the hoop stretch, the fifth component of F
        stress = _apply_chain_rule(modes, slope + pressure / deformed.stretches)
        return stress, moduli


@dataclass(frozen=True, kw_only=True, eq=False)
class Deformed:
    """A deformed half body with displacements u (nodes, 2) [mm].

    `F` (5, elements, points) [1] is the deformation gradient at the Gauss points. `stretches` (3, elements, points) [1]
    are its principal stretches. `energy` [N mm] is the strain energy for E = 1 MPa, or infinity if an element is
    inverted.
    """

    u: Floats
    F: Floats
    stretches: Floats
    energy: float


def _element_boundaries(section: Section, contact: float, refinement: float, edge: float) -> tuple[Floats, Floats]:
    """Return the coordinates of the element boundaries in the unit square of a section, across and downwards.

    Each array increases from 0 to 1. Elements are small near the axis and the top or, for a plunger, near its edge.
    `contact` [mm] is the radius of the largest contact, and `edge` [mm] the radius of a plunger or infinity. Doubling
    the `refinement` halves the element size.
    """
    half_width = float(section.place(np.array(1.0), np.array(0.0))[0])
    top_half_width = float(section.place(np.array(1.0), np.array(1.0))[0])
    if edge < top_half_width:
        across = _boundaries_around_edge(edge / top_half_width, refinement)
        down = _graded_boundaries(_EDGE_ELEMENT * edge / section.half_height, refinement, _GROWTH_FROM_EDGE)
    else:
        # Elements grow from the axis towards the side, and equally from the top downwards.
        across = down = _graded_boundaries(_FIRST_ELEMENT * min(1.0, contact / half_width), refinement)
    return across, down


def _boundaries_around_edge(edge: float, refinement: float) -> Floats:
    """Return the boundaries from 0 to 1 of elements that grow from the edge of a plunger towards the axis and the side.

    `edge` [1] is the position of the edge, between 0 on the axis and 1 on the side. The edge itself is a boundary.
    """
    inner = edge * (1.0 - _graded_boundaries(_EDGE_ELEMENT, refinement, _GROWTH_FROM_EDGE)[::-1])
    outer_width = 1.0 - edge
    first = _EDGE_ELEMENT * edge / outer_width  # the elements on the two sides of the edge have equal sizes
    outer = edge + outer_width * _graded_boundaries(first, refinement, _GROWTH_FROM_EDGE)
    return np.concatenate([inner, outer[1:]])  # the edge is included only once


def _dofs_held_by_symmetry(index: Ints) -> Flags:
    """Return which dofs are fixed by symmetry, shape (2 nodes,).

    `index` (columns, rows) holds the index of each node. Dof 2 i moves node i along r, and dof 2 i + 1 along z.
    """
    held = np.zeros((index.size, 2), dtype=bool)
    held[index[0], 0] = True  # nodes on the axis cannot move along r
    held[index[:, 0], 1] = True  # nodes on the middle plane cannot move along z
    return held.ravel()


def _surface_nodes(index: Ints) -> Ints:
    """Return the indices of the nodes that a tool may touch: along the top from the axis, and then down the side.

    `index` (columns, rows) holds the index of each node.
    """
    top = index[:, -1]
    side = index[-1, -2::-1]  # without the corner, which belongs to the top
    return np.concatenate([top, side])


def _element_nodes(index: Ints) -> Ints:
    """Return the indices of the 3 x 3 nodes of each element, shape (elements, 9).

    `index` (columns, rows) holds the index of each node, which increases by 1 along a column. Neighbouring elements
    share three nodes, so an element begins at every second column and at every second row.
    """
    rows = index.shape[1]
    first_nodes = index[:-1:2, :-1:2].reshape(-1, 1)  # the node of each element with the smallest index
    nodes: Ints = first_nodes + (rows * np.arange(3)[:, None] + np.arange(3)).reshape(1, -1)
    return nodes


def _reference_element() -> tuple[Floats, Floats, Floats]:
    """Return the shape functions of an element, their gradients, and the weights of its Gauss points.

    The shape functions have shape (points, 9), the gradients (points, 9, 2), and the weights (points,). Derivatives are
    with respect to the coordinates of the reference square, which run from -1 to 1.
    """
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    along = np.repeat(points, _POINTS)
    upward = np.tile(points, _POINTS)
    shapes = tensor_product(quadratic(along), quadratic(upward))
    gradients = np.stack(
        [
            tensor_product(quadratic_slope(along), quadratic(upward)),
            tensor_product(quadratic(along), quadratic_slope(upward)),
        ],
        axis=-1,
    )
    return shapes, gradients, np.outer(weights, weights).ravel()


def _strain_operator(x: Floats, length: float | None) -> tuple[Floats, Floats]:
    """Return the matrices that map the displacements of an element to the change in F, and the Gauss-point volumes.

    F is the deformation gradient. The nodes of the elements are at x (elements, 9, 2) [mm]. The matrices have shape
    (elements, points, 5, 18) [1/mm], the volumes (elements, points) [mm^3]. With a `length` [mm], the body is in plane
    strain, and without one it is axisymmetric.
    """
    shapes, reference_gradients, weights = _reference_element()
    # The indices are Gauss point q, node n, axes i and k, element e.
    jacobian = np.einsum("qnk,eni->eqik", reference_gradients, x)
    gradient = np.einsum("qnk,eqki->eqni", reference_gradients, np.linalg.inv(jacobian))
    r = np.einsum("qn,en->eq", shapes, x[:, :, 0])
    # The extent normal to the section is the circumference or, in plane strain, twice the length. The reason for the
    # factor is that only the half r >= 0 of the section is modelled.
    extent = 2.0 * np.pi * r if length is None else 2.0 * length * np.ones_like(r)
    volumes = np.linalg.det(jacobian) * weights * extent

    # The last three axes are the components of F (rr, rz, zr, zz, hoop), the nodes, and the displacements (r, z).
    operator = np.zeros((*volumes.shape, 5, 9, 2))
    operator[:, :, 0, :, 0] = gradient[..., 0]
    operator[:, :, 1, :, 0] = gradient[..., 1]
    operator[:, :, 2, :, 1] = gradient[..., 0]
    operator[:, :, 3, :, 1] = gradient[..., 1]
    if length is None:  # the hoop strain is u_r / r, and 0 in plane strain
        operator[:, :, 4, :, 0] = shapes / r[:, :, None]
    return operator.reshape(*volumes.shape, 5, _ELEMENT_DOFS), volumes


def _nodal_areas(x: Floats, length: float | None) -> Floats:
    """Return the surface area of each node [mm^2] by Simpson's rule, for a line of nodes at x (nodes, 2) [mm].

    `length` [mm] is the length of a body in plane strain, or None for an axisymmetric body.
    """
    # An edge of an element has three nodes, and shares its first and its last node with its neighbours.
    edge_lengths = np.linalg.norm(x[2::2] - x[:-2:2], axis=1)
    line_share = np.zeros(len(x))  # length of the line that each node represents [mm]
    for node, weight in enumerate((1.0, 4.0, 1.0)):
        np.add.at(line_share, 2 * np.arange(len(edge_lengths)) + node, weight / 6.0 * edge_lengths)
    if length is None:
        return line_share * (2.0 * np.pi * x[:, 0])  # times the circumference
    return line_share * (2.0 * length)  # only the half r >= 0 of the section is modelled


def _apply_chain_rule(modes: Floats, principal: Floats) -> Floats:
    """Return the derivatives of a quantity with respect to the components of F, shape (5, ...), by the chain rule.

    `principal` (3, ...) holds its derivatives with respect to the principal stretches. The first two `modes` are the
    derivatives of the in-plane stretches with respect to F.
    """
    in_plane = principal[0] * modes[0] + principal[1] * modes[1]
    return np.concatenate([in_plane, principal[2:]])


def _graded_boundaries(first: float, refinement: float, growth: float = _GROWTH) -> Floats:
    """Return the boundaries of elements from 0 to 1, whose lengths grow by the factor `growth` if `refinement` is 1.

    The first element is about `first` / `refinement` long, and none is longer than _LARGEST_ELEMENT / `refinement`.
    """
    # Refinement also reduces the growth, so that it divides the size of the elements by the same factor everywhere.
    refined_growth = 1.0 + (growth - 1.0) / refinement
    boundaries = [0.0]
    step = first / refinement
    while boundaries[-1] < 1.0:
        boundaries.append(boundaries[-1] + step)
        step = min(refined_growth * step, _LARGEST_ELEMENT / refinement)
    return np.array(boundaries) / boundaries[-1]  # the last boundary becomes exactly 1


def _with_midpoints(boundaries: Floats) -> Floats:
    """Return the `boundaries` of elements together with the midpoint of each element, in increasing order."""
    return np.sort(np.concatenate([boundaries, 0.5 * (boundaries[1:] + boundaries[:-1])]))

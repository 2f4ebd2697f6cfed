"""Finite elements of the upper half of a body that is compressed along z, and the strain energy of the body.

The body is axisymmetric about z, or in plane strain because it is long in the direction normal to its section. The
lower half is the mirror image of the upper half.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix

from sensor.arrays import Floats, Ints
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
    """The upper half of the section of a body along the direction of compression; lengths in mm.

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

        `across` is 0 on the axis and 1 on the side; `up` is 0 on the middle plane and 1 at the top.
        """
        if not self.is_round:
            return self.radius * across, self.half_height * up
        half_width = math.sqrt(self.radius * self.half_height)  # the other semi-axis of the ellipse
        return half_width * across * np.sqrt(1.0 - 0.5 * up**2), self.half_height * up * np.sqrt(1.0 - 0.5 * across**2)


class HalfBody:
    """The finite-element model of the upper half of a body, with a law of flesh for E = 1 MPa.

    Displacements (nodes, 2) [mm] are along r and z. `x` (nodes, 2) [mm] are the positions of the nodes of the
    undeformed body. `surface` holds the indices of the nodes that a tool may touch, outwards from the axis. `area`
    [mm^2] is the surface area of each of these nodes. `held` (2 nodes,) marks the dofs that are fixed by symmetry.
    `on_table` holds the indices of the nodes on a table.
    """

    def __init__(
        self, section: Section, law: FleshLaw, contact: float, refinement: float = 1.0, edge: float = math.inf
    ) -> None:
        """Place the nodes, and compute the matrices that map displacements to deformation gradients.

        `contact` [mm] is the approximate radius of the largest contact. `edge` [mm] is the radius of a flat plunger,
        and infinite for other tools. Doubling the `refinement` halves the element size.
        """
        self.law = law
        lines, lines_down = _section_lines(section, contact, refinement, edge)
        across = _with_midpoints(lines)
        up = 1.0 - _with_midpoints(lines_down)[::-1]
        columns = len(across)
        rows = len(up)
        r, z = section.place(*np.meshgrid(across, up, indexing="ij"))
        self.x = np.stack([r.ravel(), z.ravel()], axis=1)
        self.count = len(self.x)

        # Nodes are numbered upwards in columns, which begin at the axis. An element has 3 x 3 nodes.
        index = np.arange(self.count).reshape(columns, rows)
        corners = index[:-1:2, :-1:2].reshape(-1, 1)
        nodes = corners + (rows * np.arange(3)[:, None] + np.arange(3)).reshape(1, -1)
        self.dofs: Ints = (2 * nodes[:, :, None] + np.arange(2)).reshape(-1, _ELEMENT_DOFS)
        held = np.zeros((self.count, 2), dtype=bool)
        held[index[0], 0] = True  # nodes on the axis cannot move along r
        held[index[:, 0], 1] = True  # nodes on the middle plane cannot move along z
        self.held = held.ravel()
        self.surface: Ints = np.concatenate([index[:, -1], index[-1, -2::-1]])  # along the top, then down the side
        self.on_table: Ints = index[:, 0] if section.on_table else index[:0, 0]
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
        if not stretches.min() > 0.0:
            return Deformed(u=u, F=F, stretches=stretches, energy=math.inf)
        density = self.law.phi(stretches)[0].sum(axis=0) + self.law.U(np.log(stretches.prod(axis=0)))[0]
        return Deformed(u=u, F=F, stretches=stretches, energy=float((self._volumes * density).sum()))

    def tangent(self, deformed: "Deformed", *, convex: bool) -> tuple[Floats, csc_matrix]:
        """Return the internal nodal forces (2 nodes,) [N] and the tangent stiffness (2 nodes, 2 nodes) [N/mm].

        They are the first and second derivatives of the strain energy by the displacements in the state `deformed`.
        With `convex`, negative stiffnesses of the modes at the Gauss points are set to 0. The matrix is then positive
        semidefinite, so that a Newton step lowers the energy.
        """
        _, slope, curvature = self.law.phi(deformed.stretches)
        _, pressure, bulk = self.law.U(np.log(deformed.stretches.prod(axis=0)))
        modes = principal_modes(deformed.F)
        stiffness = mode_stiffness(deformed.stretches, slope, curvature, pressure)
        if convex:
            stiffness = np.maximum(stiffness, 0.0)

        # `moduli` are the second derivatives of the energy density by the components i and j of F. The outer product is
        # the part of U that is due to its curvature in theta; the modes contribute all other terms.
        theta_gradient = _gradient_by_F(modes, 1.0 / deformed.stretches)
        moduli = bulk * theta_gradient[:, None] * theta_gradient[None, :]
        moduli[:4, :4] += np.einsum("meq,mieq,mjeq->ijeq", stiffness[:4], modes, modes, optimize=True)
        moduli[4, 4] += stiffness[4]
        stress = _gradient_by_F(modes, slope + pressure / deformed.stretches)  # first Piola-Kirchhoff stress

        # Integrate over the elements. The indices are element e, Gauss point q, dofs d and f.
        matrices = np.einsum("eqid,ijeq,eqjf->edf", self._strain, self._volumes * moduli, self._strain, optimize=True)
        forces = np.einsum("ieq,eqid->ed", self._volumes * stress, self._strain, optimize=True)
        size = 2 * self.count
        rows = np.repeat(self.dofs, _ELEMENT_DOFS, axis=1)
        columns = np.tile(self.dofs, (1, _ELEMENT_DOFS))
        matrix = csc_matrix((matrices.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
        total = np.bincount(self.dofs.ravel(), forces.ravel(), minlength=size)
        return total.astype(np.float64, copy=False), matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class Deformed:
    """A deformed half body with displacements u (nodes, 2) [mm].

    `F` (5, elements, points) [1] is the deformation gradient at the Gauss points. `stretches` (3, elements, points) [1]
    are its principal stretches. `energy` [N mm] is the strain energy for E = 1 MPa; it is infinite if an element is
    inverted.
    """

    u: Floats
    F: Floats
    stretches: Floats
    energy: float


def _section_lines(section: Section, contact: float, refinement: float, edge: float) -> tuple[Floats, Floats]:
    """Return the coordinates of the element boundaries in the unit square of a section, across and downwards.

    Each array increases from 0 to 1. Elements are small near the axis and the top or, for a plunger, near its `edge`
    [mm]. `contact` [mm] and `refinement` are the arguments of `HalfBody`.
    """
    half_width = float(section.place(np.array(1.0), np.array(0.0))[0])
    top_width = float(section.place(np.array(1.0), np.array(1.0))[0])
    if edge < top_width:
        # Elements grow in both directions from the edge of the plunger, towards the axis and towards the side.
        edge_share = edge / top_width
        inner = edge_share * (1.0 - _graded_lines(_EDGE_ELEMENT, refinement, _GROWTH_FROM_EDGE)[::-1])
        outer_share = 1.0 - edge_share
        first = _EDGE_ELEMENT * edge_share / outer_share
        outer = edge_share + outer_share * _graded_lines(first, refinement, _GROWTH_FROM_EDGE)
        lines = np.concatenate([inner, outer[1:]])
        lines_down = _graded_lines(_EDGE_ELEMENT * edge / section.half_height, refinement, _GROWTH_FROM_EDGE)
    else:
        lines = lines_down = _graded_lines(_FIRST_ELEMENT * min(1.0, contact / half_width), refinement)
    return lines, lines_down


def _strain_operator(x: Floats, length: float | None) -> tuple[Floats, Floats]:
    """Return the matrices that map the displacements of an element to the change in F, and the Gauss-point volumes.

    The nodes of the elements are at x (elements, 9, 2) [mm]. The matrices have shape (elements, points, 5, 18) [1/mm],
    the volumes (elements, points) [mm^3]. With a `length` [mm] the body is in plane strain; without, axisymmetric.
    """
    points, weights = np.polynomial.legendre.leggauss(_POINTS)
    along = np.repeat(points, _POINTS)
    upward = np.tile(points, _POINTS)
    value = tensor_product(quadratic(along), quadratic(upward))
    slope = np.stack(
        [
            tensor_product(quadratic_slope(along), quadratic(upward)),
            tensor_product(quadratic(along), quadratic_slope(upward)),
        ],
        axis=-1,
    )
    jacobian = np.einsum("qnk,eni->eqik", slope, x)
    gradient = np.einsum("qnk,eqki->eqni", slope, np.linalg.inv(jacobian))
    r = np.einsum("qn,en->eq", value, x[:, :, 0])
    # The extent normal to the section is the circumference or, in plane strain, twice the length: the section is
    # modelled only for r >= 0.
    extent = 2.0 * np.pi * r if length is None else 2.0 * length * np.ones_like(r)
    volumes = np.linalg.det(jacobian) * np.outer(weights, weights).ravel() * extent

    operator = np.zeros((*volumes.shape, 5, 9, 2))  # components of F: rr, rz, zr, zz, hoop
    operator[:, :, 0, :, 0] = gradient[..., 0]
    operator[:, :, 1, :, 0] = gradient[..., 1]
    operator[:, :, 2, :, 1] = gradient[..., 0]
    operator[:, :, 3, :, 1] = gradient[..., 1]
    if length is None:
        operator[:, :, 4, :, 0] = value / r[:, :, None]
    return operator.reshape(*volumes.shape, 5, _ELEMENT_DOFS), volumes


def _nodal_areas(x: Floats, length: float | None) -> Floats:
    """Return the surface area of each node [mm^2] by Simpson's rule, for a line of nodes at x (nodes, 2) [mm].

    `length` [mm] is the length of a body in plane strain, or None for an axisymmetric body.
    """
    edges = np.linalg.norm(x[2::2] - x[:-2:2], axis=1)
    area = np.zeros(len(x))
    for node, weight in enumerate((1.0, 4.0, 1.0)):
        np.add.at(area, 2 * np.arange(len(edges)) + node, weight / 6.0 * edges)
    return area * (2.0 * np.pi * x[:, 0] if length is None else 2.0 * length)


def _gradient_by_F(modes: Floats, principal: Floats) -> Floats:
    """Return the derivatives of a quantity by the components of F, shape (5, ...), by the chain rule.

    `principal` (3, ...) holds the derivatives of the quantity by the principal stretches. The first two `modes` are the
    derivatives of the in-plane stretches by F.
    """
    in_plane = principal[0] * modes[0] + principal[1] * modes[1]
    return np.concatenate([in_plane, principal[2:]])


def _graded_lines(first: float, refinement: float, growth: float = _GROWTH) -> Floats:
    """Return the boundaries of elements from 0 to 1, each `growth` times as large as the previous one.

    The first element is about `first` / `refinement` long, and none is longer than _LARGEST_ELEMENT / `refinement`.
    Refinement also reduces the growth. The boundaries are finally scaled so that the last one is 1.
    """
    growth = 1.0 + (growth - 1.0) / refinement
    lines = [0.0]
    step = first / refinement
    while lines[-1] < 1.0:
        lines.append(lines[-1] + step)
        step = min(growth * step, _LARGEST_ELEMENT / refinement)
    return np.array(lines) / lines[-1]


def _with_midpoints(lines: Floats) -> Floats:
    """Return the coordinates `lines` together with the midpoint of each interval, in increasing order."""
    return np.sort(np.concatenate([lines, 0.5 * (lines[1:] + lines[:-1])]))

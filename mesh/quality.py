"""Mesh checks: the quality of tetrahedra, and the agreement of volume and areas with the solid."""

import numpy as np
from skfem import Mesh

from mesh.session import Ints, MeshError
from sensor.arrays import Floats


def scaled_jacobian(points: Floats, tets: Ints) -> Floats:
    """Return the scaled Jacobian [1] of each tetrahedron, shape (m,): 1 if regular, 0 if flat, negative if inverted.

    The scaled Jacobian is sqrt(2) det J / lambda. Here lambda is the largest product of the three edge lengths at a
    corner, or |det J| if that is larger. The factor sqrt(2) makes the result 1 for a regular tetrahedron. `points` (3,
    n) [mm] are the nodes, and `tets` (4, m) the indices of the corners. See P. Stimpson et al., The Verdict Library
    Reference Manual, 2007, section 6.14.
    """
    corners = points[:, tets]  # (3, 4, m)
    edges = corners[:, 1:] - corners[:, :1]  # the three edges at the first corner
    determinants = np.einsum("im,im->m", np.cross(edges[:, 0], edges[:, 1], axis=0), edges[:, 2])
    largest_product = np.abs(determinants)
    for corner in range(4):
        other_corners = np.delete(corners, corner, axis=1)
        edge_lengths = np.linalg.norm(other_corners - corners[:, corner, None], axis=0)
        largest_product = np.maximum(largest_product, edge_lengths.prod(axis=0))
    # A tetrahedron that has shrunk to a point gets the scaled Jacobian 0, without a division by zero.
    return np.asarray(np.sqrt(2.0) * determinants / np.where(largest_product > 0.0, largest_product, 1.0))


def check_quality(points: Floats, tets: Ints, least_quality: float) -> float:
    """Return the smallest scaled Jacobian [1] of tetrahedra, and check that it is at least `least_quality` [1].

    `points` (3, n) [mm] are the nodes, and `tets` (4, m) the indices of the corners. Raises MeshError if the smallest
    value is below `least_quality` or not a number.
    """
    quality = scaled_jacobian(points, tets)
    worst_tet = int(np.argmin(quality))
    if not quality[worst_tet] >= least_quality:
        x, y, z = points[:, tets[:, worst_tet]].mean(axis=1)
        reason = (
            f"smallest scaled Jacobian = {quality[worst_tet]:.3g} at ({x:.3g}, {y:.3g}, {z:.3g}) mm: "
            f"must be at least {least_quality:g}"
        )
        raise MeshError("quality", reason, "use smaller elements there, or remove a sliver from the solid")
    return float(quality[worst_tet])


def named_facets(mesh: Mesh, name: str) -> Ints:
    """Return the indices of the mesh facets on a named face, shape (facets,). Raises MeshError if there are none."""
    boundaries = mesh.boundaries or {}
    if name not in boundaries or not len(boundaries[name]):
        known_names = ", ".join(boundaries) or "none"
        raise MeshError("compare", f"face {name!r} has no facets", f"the mesh has these named faces: {known_names}")
    return np.asarray(boundaries[name])


def compare(what: str, measured: float, expected: float, tolerance: float, hint: str) -> None:
    """Raise MeshError unless an area or a volume of a mesh agrees with the solid within a relative tolerance [1].

    `measured` belongs to the mesh and `expected` to the solid, both in mm^2 or mm^3. `what` names the area or volume in
    the error message, and `hint` tells the user what to do.
    """
    if not abs(measured - expected) <= tolerance * abs(expected):
        reason = f"{what} = {measured:.9g}: must be {expected:.9g} of the solid within {tolerance:g}"
        raise MeshError("compare", reason, hint)

"""Checks of a mesh: the quality of its tetrahedra, and its volume and areas against the solid."""

import numpy as np
from skfem import Mesh

from mesh.session import Ints, MeshError
from sensor.arrays import Floats


def scaled_jacobian(points: Floats, tets: Ints) -> Floats:
    """Return the scaled Jacobian of each tetrahedron [1]: 1 if regular, 0 if flat, negative if inverted.

    It is sqrt(2) det J over the largest product of the three edges at a corner. Points (3, n), tets (4, m), result
    (m,). P. Stimpson et al., The Verdict Library Reference Manual, 2007, section 6.14.
    """
    corners = points[:, tets]  # (3, 4, m)
    edges = corners[:, 1:] - corners[:, :1]
    jacobian = np.einsum("im,im->m", np.cross(edges[:, 0], edges[:, 1], axis=0), edges[:, 2])
    largest = np.abs(jacobian)
    for corner in range(4):
        others = np.delete(corners, corner, axis=1)
        lengths = np.linalg.norm(others - corners[:, corner, None], axis=0)  # lengths of the three edges at a corner
        largest = np.maximum(largest, lengths.prod(axis=0))
    return np.asarray(np.sqrt(2.0) * jacobian / np.where(largest > 0.0, largest, 1.0))


def check_quality(points: Floats, tets: Ints, least: float) -> float:
    """Return the smallest scaled Jacobian [1] of points (3, n) [mm], tets (4, m); raises MeshError below `least`."""
    quality = scaled_jacobian(points, tets)
    worst = int(np.argmin(quality))
    if not quality[worst] >= least:
        x, y, z = points[:, tets[:, worst]].mean(axis=1)
        reason = (
            f"smallest scaled Jacobian = {quality[worst]:.3g} at ({x:.3g}, {y:.3g}, {z:.3g}) mm: "
            f"must be at least {least:g}"
        )
        raise MeshError("quality", reason, "take smaller elements there, or remove a sliver from the solid")
    return float(quality[worst])


def named_facets(mesh: Mesh, name: str) -> Ints:
    """Return the facets of a named face, shape (facets,); raises MeshError if it has none."""
    boundaries = mesh.boundaries or {}
    if name not in boundaries or not len(boundaries[name]):
        raise MeshError("compare", f"face {name!r} has no facets", f"its names: {', '.join(boundaries) or 'none'}")
    return np.asarray(boundaries[name])


def compare(what: str, measured: float, expected: float, tolerance: float, hint: str) -> None:
    """Raise MeshError unless a measure of a mesh agrees with the solid within the relative tolerance [mm^2 or mm^3]."""
    if not abs(measured - expected) <= tolerance * abs(expected):
        reason = f"{what} = {measured:.9g}: must be {expected:.9g} of the solid within {tolerance:g}"
        raise MeshError("compare", reason, hint)

"""A tetrahedral mesh of a part, with the part's named faces as boundaries."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import gmsh
import numpy as np
from skfem import MeshTet1

from mesh.quality import check_quality, compare, named_facets
from mesh.session import (
    SURFACE,
    Ints,
    MeshError,
    bounding_curves,
    element_nodes,
    gmsh_session,
    import_brep,
    index_by_nodes,
    stage,
    used_nodes,
)

if TYPE_CHECKING:
    from cad.parts.part import Part

_CHECK_SOLID = "check that the solid is valid"
_LOST_ORDER = "the order of the faces was lost; write the BREP file of the same solid"
_FINER = "use smaller elements on curved faces, or check the solid"
# Allowed relative difference between a face in gmsh and in CadQuery. The two agree only to the digits of the BREP file.
_FACE_TOLERANCE = 1e-6
_SAMPLING = 200  # number of points along a curve for gmsh's distance field


@dataclass(frozen=True, kw_only=True)
class SizeField:
    """The element size as a function of position: small at the outline of some faces, and increasing away from it.

    The size is `smallest_mm` at the outline of the named `faces`. The size increases with the distance from this
    outline by `growth` [mm per mm], up to `largest_mm`. Faces named in `cuts` are cuts through the body, and curves
    shared with them do not belong to the outline. If there are no `faces`, the size is `largest_mm` everywhere.
    """

    largest_mm: float
    smallest_mm: float = 0.0
    growth: float = 0.0
    faces: tuple[str, ...] = ()
    cuts: tuple[str, ...] = ()


def volume_mesh(part: Part, size: SizeField, *, tolerance: float = 1e-9, least_quality: float = 0.05) -> MeshTet1:
    """Divide a part into straight-sided tetrahedra [mm], with the part's named faces as boundaries.

    `size` is the element size as a function of position. `tolerance` [1] is the largest allowed relative difference
    between mesh and solid, in volume and in the area of each named face. A part with curved faces needs a larger
    tolerance than the default. `least_quality` [1] is the smallest allowed scaled Jacobian. Raises MeshError if `size`
    names an unknown face, or if the mesh does not meet these limits. Raises MachineError if gmsh fails.
    """
    for name in (*size.faces, *size.cuts):
        if name not in part.faces:
            names = ", ".join(part.faces) or "none"
            raise MeshError("names", f"part {part.name!r} has no face {name!r}", f"its faces: {names}")
    with gmsh_session():
        surfaces = _import_part(part)
        surfaces_of_names = {name: [surfaces[i] for i in indices] for name, indices in part.faces.items()}
        _set_size(size, surfaces_of_names)
        with stage("generate", "use smaller elements, or check the solid"):
            gmsh.model.mesh.generate(3)
        with stage("read", "check the solid"):
            node_tags = element_nodes("Tetrahedron")
            nodes = used_nodes(node_tags)
            triangles = [nodes.index[element_nodes("Triangle", entity=surface)] for surface in surfaces]
    points = nodes.points
    tets = np.ascontiguousarray(nodes.index[node_tags])
    check_quality(points, tets, least_quality)
    mesh = MeshTet1(points, tets)
    mesh = mesh.with_boundaries(_named_boundaries(mesh, part, triangles))
    check_against_part(mesh, part, tolerance)
    return mesh


def _named_boundaries(mesh: MeshTet1, part: Part, triangles: Sequence[Ints]) -> dict[str, Ints]:
    """Return the indices of the mesh facets on each named face of a part.

    `triangles` holds, for each face of the solid, the node indices (3, n) of gmsh's triangles on it. Raises MeshError
    if a triangle is not an outer facet of the mesh.
    """
    boundary_facets = mesh.boundary_facets()
    boundaries = {}
    for name, indices in part.faces.items():
        triangles_on_face = np.hstack([triangles[i] for i in indices])
        position = index_by_nodes(mesh.facets[:, boundary_facets], triangles_on_face)  # in `boundary_facets`, or -1
        if (position < 0).any():
            raise MeshError("read", "a triangle of a face is not an outer facet of the mesh", "check the solid")
        boundaries[name] = boundary_facets[position]
    return boundaries


def check_against_part(mesh: MeshTet1, part: Part, tolerance: float) -> None:
    """Raise MeshError unless mesh and part agree in volume and in every named area, within a relative tolerance [1]."""
    mapping = mesh.mapping()
    # detA and detB are the Jacobian determinants of cells and facets. The unit cell has volume 1/6, its facet area 1/2.
    volume = float(np.abs(mapping.detA).sum()) / 6.0
    compare("volume", volume, float(part.shape.Volume()), tolerance, _FINER)
    for name in part.faces:
        area = 0.5 * float(mapping.detB[named_facets(mesh, name)].sum())
        compare(f"area of face {name!r}", area, part.face_area(name), tolerance, _FINER)


def _import_part(part: Part) -> list[int]:
    """Load the part into gmsh, and return gmsh's surface tags in the order of the part's faces.

    Raises MeshError if gmsh's surfaces differ from these faces.
    """
    import_brep(part.write_brep, _CHECK_SOLID)
    with stage("import", _CHECK_SOLID):
        gmsh.model.occ.synchronize()
        tags = [tag for _, tag in gmsh.model.getEntities(SURFACE)]
    _check_faces(part, tags)
    return tags


def _check_faces(part: Part, tags: Sequence[int]) -> None:
    """Raise MeshError unless gmsh's surfaces are the part's faces in the same order.

    `tags` are gmsh's surface tags. A surface is the same as a face if their areas and centroids agree.
    """
    faces = part.shape.Faces()
    if len(tags) != len(faces):
        reason = f"gmsh has {len(tags)} faces, but the solid has {len(faces)}"
        raise MeshError("import", reason, _CHECK_SOLID)
    for index, (face, tag) in enumerate(zip(faces, tags, strict=True)):
        area = gmsh.model.occ.getMass(SURFACE, tag)  # the mass of a surface is its area
        expected_area = face.Area()
        shift = math.dist(face.Center().toTuple(), gmsh.model.occ.getCenterOfMass(SURFACE, tag))
        typical_length = math.sqrt(expected_area)
        if abs(area - expected_area) > _FACE_TOLERANCE * expected_area or shift > _FACE_TOLERANCE * typical_length:
            difference = f"area {area:.6g} mm^2 instead of {expected_area:.6g} mm^2, centroid {shift:.3g} mm away"
            raise MeshError("import", f"gmsh's face {index} is not the solid's face {index}: {difference}", _LOST_ORDER)


def _set_size(size: SizeField, surfaces_of_names: dict[str, list[int]]) -> None:
    """Set gmsh's background field, which determines the element size at each position, to `size`.

    `surfaces_of_names` maps the name of each face to gmsh's surface tags.
    """
    field = gmsh.model.mesh.field

    def curves_around(names: Sequence[str]) -> set[int]:
        """Return gmsh's tags of the curves around the faces with these names."""
        return set(bounding_curves(tag for name in names for tag in surfaces_of_names[name]))

    with stage("size", "check the sizes"):
        formula = repr(size.largest_mm)  # a constant size
        if size.faces:
            # The size is the smaller of the largest size and a size that increases with the distance from the outline.
            outline = curves_around(size.faces) - curves_around(size.cuts)
            distance = field.add("Distance")
            field.setNumbers(distance, "CurvesList", sorted(outline))
            field.setNumber(distance, "Sampling", _SAMPLING)
            # In a gmsh formula, F<tag> is the value of another field, here the distance from the outline [mm].
            formula = f"Min({size.largest_mm!r}, {size.smallest_mm!r} + {size.growth!r} * F{distance})"
        element_size = field.add("MathEval")
        field.setString(element_size, "F", formula)
        field.setAsBackgroundMesh(element_size)

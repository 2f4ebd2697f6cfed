"""A tetrahedral mesh of a part, whose boundaries have the names of the part's faces."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import gmsh
import numpy as np
from skfem import MeshTet1

from mesh.quality import check_quality, compare, named_facets
from mesh.session import Ints, MeshError, element_nodes, gmsh_session, index_by_nodes, stage, used_nodes

if TYPE_CHECKING:
    from cad.parts.part import Part

_LOST = "the order of the faces was lost; write the BREP file of the same solid"
_FINER = "take smaller elements on curved faces, or check the solid"
_SAME = 1e-6  # relative difference of faces; gmsh reads the written shape, so they agree to the digits of the file
_SAMPLING = 200  # points along a curve for gmsh's distance field


@dataclass(frozen=True, kw_only=True)
class SizeField:
    """Element size [mm]: `smallest_mm` at the outline of the named faces, growing by `growth` per mm, to `largest_mm`.

    The outline leaves out curves shared with the faces named in `cuts`, at which the solid continues. Without faces the
    size is uniform.
    """

    largest_mm: float
    smallest_mm: float = 0.0
    growth: float = 0.0
    faces: tuple[str, ...] = ()
    cuts: tuple[str, ...] = ()


def volume_mesh(part: Part, size: SizeField, *, tolerance: float = 1e-9, least_quality: float = 0.05) -> MeshTet1:
    """Return the tetrahedral mesh [mm] of a part with its named faces as boundaries.

    `tolerance` is the largest relative difference of the volume and each named area from the solid; curved faces need
    more than the default. `least_quality` is the smallest allowed scaled Jacobian [1]. Raises MeshError with the failed
    stage.
    """
    for name in (*size.faces, *size.cuts):
        if name not in part.faces:
            names = ", ".join(part.faces) or "none"
            raise MeshError("names", f"face {name!r} is unknown on part {part.name!r}", f"its faces: {names}")
    with gmsh_session():
        tags = _imported(part)
        _set_size(size, {name: [tags[i] for i in indices] for name, indices in part.faces.items()})
        with stage("generate", "take smaller elements, or check the solid"):
            gmsh.model.mesh.generate(3)
        with stage("read", "check the solid"):
            tets = element_nodes("Tetrahedron")
            nodes = used_nodes(tets)  # drops nodes that no tetrahedron uses
            triangles = [nodes.index[element_nodes("Triangle", entity=tag)] for tag in tags]
    points = nodes.points
    tets = np.ascontiguousarray(nodes.index[tets])
    check_quality(points, tets, least_quality)
    mesh = MeshTet1(points, tets)
    mesh = mesh.with_boundaries(_named_boundaries(mesh, part, triangles))
    check_against_part(mesh, part, tolerance)
    return mesh


def _named_boundaries(mesh: MeshTet1, part: Part, triangles: Sequence[Ints]) -> dict[str, Ints]:
    """Return the facets of the mesh on each named face of a part; raises MeshError.

    `triangles` has the nodes (3, n) of the triangles on each face of the solid, in the order of its faces.
    """
    outside = mesh.boundary_facets()
    boundaries = {}
    for name, indices in part.faces.items():
        index = index_by_nodes(mesh.facets[:, outside], np.hstack([triangles[i] for i in indices]))
        if (index < 0).any():
            raise MeshError("read", "a triangle of a face is not an outer facet of the mesh", "check the solid")
        boundaries[name] = outside[index]
    return boundaries


def check_against_part(mesh: MeshTet1, part: Part, tolerance: float) -> None:
    """Raise MeshError if the volume or a named area differs from the part's by more than the relative tolerance [1]."""
    mapping = mesh.mapping()
    volume = float(np.abs(mapping.detA).sum()) / 6.0
    compare("volume", volume, float(part.shape.Volume()), tolerance, _FINER)
    for name in part.faces:
        area = 0.5 * float(mapping.detB[named_facets(mesh, name)].sum())
        compare(f"area of face {name!r}", area, part.face_area(name), tolerance, _FINER)


def _imported(part: Part) -> list[int]:
    """Read the part into gmsh; return the surface tags in the order of the part's faces."""
    # a file in memory, because one on disk would remain after a kill
    with os.fdopen(os.memfd_create("part.brep")) as in_memory, stage("import", "check that the solid is valid"):
        path = Path(f"/proc/self/fd/{in_memory.fileno()}")
        part.write_brep(path)
        gmsh.model.occ.importShapes(str(path), format="brep")
        gmsh.model.occ.synchronize()
        tags = [tag for _, tag in gmsh.model.getEntities(2)]
    _check_faces(part, tags)
    return tags


def _check_faces(part: Part, tags: Sequence[int]) -> None:
    """Raise MeshError unless gmsh's surfaces are the part's faces, in their order."""
    faces = part.shape.Faces()
    if len(tags) != len(faces):
        reason = f"gmsh has {len(tags)} faces, the solid {len(faces)}"
        raise MeshError("import", reason, "check that the solid is valid")
    for index, (face, tag) in enumerate(zip(faces, tags, strict=True)):
        area = gmsh.model.occ.getMass(2, tag)
        wanted = face.Area()
        shift = math.dist(face.Center().toTuple(), gmsh.model.occ.getCenterOfMass(2, tag))
        if abs(area - wanted) > _SAME * wanted or shift > _SAME * math.sqrt(wanted):
            away = f"{area:.6g} mm^2, centre {shift:.3g} mm away"
            raise MeshError("import", f"face {index} is not the face {index} of the solid: {away}", _LOST)


def _set_size(size: SizeField, tags: dict[str, list[int]]) -> None:
    """Set the size field of gmsh; `tags` are the surfaces of each named face."""
    field = gmsh.model.mesh.field

    def bounding_curves(names: Sequence[str]) -> set[int]:
        surfaces = [(2, tag) for name in names for tag in tags[name]]
        return {curve for _, curve in gmsh.model.getBoundary(surfaces, combined=False, oriented=False)}

    with stage("size", "check the sizes"):
        rule = repr(size.largest_mm)
        if size.faces:
            outline = bounding_curves(size.faces) - bounding_curves(size.cuts)
            distance = field.add("Distance")
            field.setNumbers(distance, "CurvesList", sorted(outline))
            field.setNumber(distance, "Sampling", _SAMPLING)
            rule = f"Min({size.largest_mm!r}, {size.smallest_mm!r} + {size.growth!r} * F{distance})"
        formula = field.add("MathEval")
        field.setString(formula, "F", rule)
        field.setAsBackgroundMesh(formula)

"""The half y >= 0 of a housing in its mount in curved quadratic tetrahedra: with its cover, or held under washers.

Nothing is shared with the swept mesh and its elastic layers: covers are solids of their own, and a washer is a part of
the face that does not move. What is held carries the name `mounting_holes`, as it does where the holes are clamped.
"""

import math
import tempfile
from pathlib import Path

import gmsh
from reference.tetrahedra import MeshTet2, _read, _set_sizes, fine_boxes

from cad.parts.housing import Housing
from cad.parts.part import Part
from mesh.session import gmsh_session, stage

_STRETCH = 3.0
_AROUND = 14.0
_NEAR = 1e-4  # [mm]
_SURFACE = 2


def mounted_tetrahedra(part: Part, housing: Housing, size: float, cover: Part | None, washer: float = 0.0) -> MeshTet2:
    """Return the mesh [mm] of half a housing with its cover, or with washers of a diameter [mm] on its outer face.

    Without washers the whole outer face is held.
    """
    with gmsh_session():
        with stage("size", "check the sizes"):
            gmsh.option.setNumber("Mesh.ElementOrder", 2.0)
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _AROUND / size)
        names = _named_half(part, housing, cover, washer)
        _set_sizes(part, fine_boxes(housing, size), size)
        with stage("generate", "take smaller elements, or check the solid"):
            gmsh.model.mesh.generate(3)
        with stage("read", "check the solid"):
            return _read(names)


def _named_half(part: Part, housing: Housing, cover: Part | None, washer: float) -> dict[str, list[int]]:
    """Read the solids into gmsh, cut them at y = 0, return the surface tags by name."""
    occ = gmsh.model.occ
    # Flattened before they are joined, as curves that solids share are moved only once.
    half, face = _flattened(part), 0.5 * housing.depth / _STRETCH
    corner, extent = (
        (housing.left - 1.0, 0.0, -1.0),
        (housing.right - housing.left + 2.0, 99.0, housing.top_level + 2.0),
    )
    half, _ = occ.intersect(half, [(3, occ.addBox(*corner, *extent))])
    if cover is not None:
        occ.fragment(half, _flattened(cover))
        face += cover.shape.BoundingBox().ylen / _STRETCH
    if washer:
        radius = 0.5 * washer
        places = [occ.addDisk(x, face, z, radius, radius, zAxis=[0.0, 1.0, 0.0]) for x, z in housing.holes]
        occ.synchronize()
        occ.fragment(gmsh.model.getEntities(3), [(_SURFACE, tag) for tag in places])
    occ.synchronize()
    names: dict[str, list[int]] = {"low_tip": [], "high_tip": [], "mounting_holes": [], "symmetry": []}
    # Bounds of a ring are loose, its area is not.
    under_washer = 0.25 * math.pi * washer**2
    skin = {tag for _, volume in gmsh.model.getEntities(3) for tag in gmsh.model.getAdjacencies(3, volume)[1]}
    for tag in sorted(skin):
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(_SURFACE, tag)
        if max(abs(z0), abs(z1)) < _NEAR:
            names["low_tip" if x0 + x1 < 0.0 else "high_tip"].append(tag)
        elif max(abs(y0), abs(y1)) < _NEAR:
            names["symmetry"].append(tag)
        elif min(y0, y1) > face - _NEAR and (not washer or occ.getMass(_SURFACE, tag) < under_washer):
            names["mounting_holes"].append(tag)
    return names


def _flattened(part: Part) -> list[tuple[int, int]]:
    solids = _imported(part)
    gmsh.model.occ.dilate(solids, 0.0, 0.0, 0.0, 1.0, 1.0 / _STRETCH, 1.0)
    return solids


def _imported(part: Part) -> list[tuple[int, int]]:
    with tempfile.TemporaryDirectory() as folder, stage("import", "check that the solid is valid"):
        path = Path(folder) / "part.brep"
        part.write_brep(path)
        return [(dimension, tag) for dimension, tag in gmsh.model.occ.importShapes(str(path))]

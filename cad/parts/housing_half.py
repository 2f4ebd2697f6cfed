"""The half y >= 0 of the housing as a part of its own, for meshes that are made from the solid."""

from collections.abc import Callable

import cadquery as cq

from cad.parts.housing import Housing, housing_part
from cad.parts.part import Part, named_part
from cad.theory.flexure import Flexure

_NEAR = 1e-6  # [mm]
_Test = Callable[[cq.Face], bool]


def housing_half(housing: Housing) -> Part:
    """Return the half y >= 0 [mm] with the faces low_tip, high_tip, mounting_holes, symmetry, low_leaves, high_leaves.

    Leaves are the flat faces of the straight parts, whose outline is where the strain is largest.
    """
    width, height = housing.right - housing.left + 2.0, housing.top_level + 2.0
    box = cq.Solid.makeBox(width, housing.depth, height, cq.Vector(housing.left - 1.0, 0.0, -1.0))
    half = housing_part(housing).shape.intersect(box)
    diameter = housing.hole_diameter

    def is_hole(face: cq.Face) -> bool:
        box = face.BoundingBox()
        return face.geomType() == "CYLINDER" and min(box.xlen, box.zlen) > diameter - _NEAR

    faces: dict[str, _Test] = {
        "low_tip": lambda face: _at_level(face, 0.0) and face.Center().x < 0.0,
        "high_tip": lambda face: _at_level(face, 0.0) and face.Center().x > 0.0,
        "mounting_holes": is_hole,
        "symmetry": lambda face: face.BoundingBox().ymax < _NEAR,
        "low_leaves": _leaf_test(housing, housing.low, housing.low_root),
        "high_leaves": _leaf_test(housing, housing.high, housing.high_root),
    }
    return named_part("housing half", half.Solids()[0], faces)


def _leaf_test(housing: Housing, flexure: Flexure, roots: tuple[float, float]) -> _Test:
    levels = (housing.lower_leaf_level, housing.lower_leaf_level + flexure.separation)
    faces = [level + side * 0.5 * flexure.thickness for level in levels for side in (-1.0, 1.0)]

    def belongs(face: cq.Face) -> bool:
        inside = min(roots) < face.Center().x < max(roots)
        return inside and any(_at_level(face, level) for level in faces)

    return belongs


def _at_level(face: cq.Face, level: float) -> bool:
    box = face.BoundingBox()
    return max(abs(box.zmin - level), abs(box.zmax - level)) < _NEAR

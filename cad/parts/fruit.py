"""The fruit as a block with the footprints of the tips imprinted on its top face; whole, or cut where it is symmetric.

x runs along the tips, y across, z along the press; the top face is z = 0, its centre the origin. Units: mm.
"""

from collections.abc import Callable, Mapping

import cadquery as cq

from cad.design.parameters import Fruit, Tips, check_tips_on_fruit
from cad.parts.part import Part, named_part
from cad.quantity import fault

_TOUCH = 1e-6  # [mm], well under any length of a design, well over the tolerance of the geometry kernel
_Test = Callable[[cq.Face], bool]


def fruit_block(fruit: Fruit, tips: Tips) -> Part:
    """Return the whole block [mm] with the faces base, top, low_tip, high_tip.

    Raises InputError when a tip stands beyond the fruit.
    """
    half_length, half_width = 0.5 * fruit.length_mm, 0.5 * fruit.width_mm
    faces = {"base": _at(2, -fruit.height_mm), **_top_faces(tips, ("low_tip", "high_tip"))}
    return _imprinted("fruit block", fruit, tips, (-half_length, -half_width), faces)


def fruit_half(fruit: Fruit, tips: Tips) -> Part:
    """Return the half y >= 0 of the block [mm] with the faces base, top, low_tip, high_tip, symmetry_y.

    Raises InputError when a tip stands beyond the fruit.
    """
    faces = {
        "base": _at(2, -fruit.height_mm),
        "symmetry_y": _at(1, 0.0),
        **_top_faces(tips, ("low_tip", "high_tip")),
    }
    return _imprinted("fruit half", fruit, tips, (-0.5 * fruit.length_mm, 0.0), faces)


def fruit_quarter(fruit: Fruit, tips: Tips) -> Part:
    """Return the quarter x >= 0, y >= 0 [mm] with the faces base, top, high_tip, symmetry_x, symmetry_y.

    Raises InputError when the tips are off the centre, or stand beyond the fruit.
    """
    if tips.offset_mm != 0.0:
        raise fault("tips.offset_mm", tips.offset_mm, "mm", "0 for a quarter of the fruit", "take fruit_half")
    faces = {
        "base": _at(2, -fruit.height_mm),
        "symmetry_x": _at(0, 0.0),
        "symmetry_y": _at(1, 0.0),
        **_top_faces(tips, ("high_tip",)),
    }
    return _imprinted("fruit quarter", fruit, tips, (0.0, 0.0), faces)


def tip_centres(tips: Tips) -> dict[str, float]:
    """Return x of the centre of each footprint by face name [mm]."""
    low, high = tips.centres_mm
    return {"low_tip": low, "high_tip": high}


def _imprinted(name: str, fruit: Fruit, tips: Tips, corner: tuple[float, float], faces: Mapping[str, _Test]) -> Part:
    check_tips_on_fruit(fruit, tips)
    x, y = corner
    block = cq.Solid.makeBox(
        0.5 * fruit.length_mm - x, 0.5 * fruit.width_mm - y, fruit.height_mm, cq.Vector(x, y, -fruit.height_mm)
    )
    footprints = [_footprint(tips, centre) for face, centre in tip_centres(tips).items() if face in faces]
    return named_part(name, block.split(*footprints).Solids()[0], faces)


def _footprint(tips: Tips, centre: float) -> cq.Face:
    """Return the outline of a tip: a square, or a circle of four arcs, so that a mesh has its extreme points."""
    side = tips.side_mm
    if tips.shape == "cube":
        return cq.Face.makePlane(side, side, cq.Vector(centre, 0.0, 0.0))
    plane, up = cq.Vector(centre, 0.0, 0.0), cq.Vector(0.0, 0.0, 1.0)
    arcs = [cq.Edge.makeCircle(0.5 * side, plane, up, start, start + 90.0) for start in (0.0, 90.0, 180.0, 270.0)]
    return cq.Face.makeFromWires(cq.Wire.assembleEdges(arcs))


def _at(axis: int, place: float) -> _Test:
    """Pick the plane faces that lie at a coordinate."""

    def belongs(face: cq.Face) -> bool:
        box = face.BoundingBox()
        low, high = ((box.xmin, box.xmax), (box.ymin, box.ymax), (box.zmin, box.zmax))[axis]
        return abs(low - place) < _TOUCH and abs(high - place) < _TOUCH

    return belongs


def _top_faces(tips: Tips, names: tuple[str, ...]) -> dict[str, _Test]:
    """Pick each footprint by its place, and as the top what is left of it."""
    level = _at(2, 0.0)

    def footprint(centre: float) -> _Test:
        def belongs(face: cq.Face) -> bool:
            box = face.BoundingBox()
            inside = abs(0.5 * (box.xmin + box.xmax) - centre) < _TOUCH and box.xmax - box.xmin < tips.side_mm + _TOUCH
            return level(face) and inside and box.ymax < 0.5 * tips.side_mm + _TOUCH

        return belongs

    tests = {name: footprint(tip_centres(tips)[name]) for name in names}
    return {"top": lambda face: level(face) and not any(test(face) for test in tests.values()), **tests}

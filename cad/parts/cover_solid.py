"""The cover that closes the frame: one flat plate with a rim, printed twice, for the front and for the back.

It is drawn as the back one, behind the face y = depth / 2 of the housing; turned by half a turn about its upright
middle line it is the front one. The rim lies on the frame alone, so nothing that moves can touch the plate.
"""

import cadquery as cq

from cad.parts.cover import Cover, cover_level
from cad.parts.housing import Housing
from cad.parts.part import FaceTest, Part, is_hole, named_part, on_plane
from cad.parts.sensor import Sensor


def cover_of(sensor: Sensor) -> Cover:
    """Return the cover whose foot stays above the frame's lower edge in every tilt that the frame is made for."""
    return Cover(housing=sensor.housing, foot_level=cover_level(sensor.housing.protrusion, sensor.press))


def cover_part(cover: Cover) -> Part:
    """Return the back cover as one solid with the faces `rim` and `mounting_holes`."""
    housing, inner = cover.housing, 0.5 * cover.housing.depth
    width, height = housing.right - housing.left, housing.top_level - cover.foot_level
    outside = cq.Vector(housing.left, inner, cover.foot_level)
    plate = cq.Workplane(obj=cq.Solid.makeBox(width, cover.thickness, height, outside))
    if cover.recess > 0.0:
        plate = plate.cut(cq.Workplane(obj=_inside_the_rim(cover)))
    back = cq.Workplane("XZ", origin=(0.0, inner + cover.thickness + 1.0, 0.0))
    drill = back.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter).extrude(cover.thickness + 2.0)
    faces: dict[str, FaceTest] = {
        "rim": on_plane(1, inner),
        "mounting_holes": lambda face: is_hole(face, housing.hole_diameter),
    }
    return named_part("cover", plate.cut(drill).findSolid().Solids()[0], faces)


def _inside_the_rim(cover: Cover) -> cq.Solid:
    """Return what is cut from the plate, so that its rim alone touches the frame; open towards the tips."""
    housing, beyond = cover.housing, cover.recess
    wall, top = housing.wall_width - cover.setback, housing.cavity_level + cover.setback
    width, height = housing.right - housing.left - 2.0 * wall, top - cover.foot_level + beyond
    corner = cq.Vector(housing.left + wall, 0.5 * housing.depth - beyond, cover.foot_level - beyond)
    return cq.Solid.makeBox(width, 2.0 * cover.recess, height, corner)


def turned(shape: cq.Shape, housing: Housing) -> cq.Shape:
    """Return a cover turned from one side of the housing to the other, about the upright line in its middle [mm]."""
    middle = 0.5 * (housing.left + housing.right)
    return shape.rotate(cq.Vector(middle, 0.0, 0.0), cq.Vector(middle, 0.0, 1.0), 180.0)

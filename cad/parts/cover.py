"""The cover that closes the frame: one flat plate with a rim, printed twice, for the front and for the back.

It is drawn as the back one, behind the face y = depth / 2 of the housing; turned by half a turn about its upright
middle line it is the front one. The rim lies on the frame alone, so nothing that moves can touch the plate.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cadquery as cq
import numpy as np

from cad.checks.clearance import fruit_finding, moving_parts, steepest
from cad.design.processes import Process
from cad.parts.housing import Housing
from cad.parts.part import Part, named_part
from cad.parts.sensor import Sensor
from cad.parts.tips import PLACE_TOLERANCE_MM
from cad.verdict import Verdict, at_least, equal, failed

PLATE_MM = 2.0
RECESS_MM = 1.0  # twice the widest gap that a process must keep open
SETBACK_MM = 1.0  # of the rim from every edge of the frame beside which something moves
_STEPS = (0.0, 0.5, 1.0)  # shares of the way to the stops
_NEAR = 1e-6


@dataclass(frozen=True, kw_only=True)
class Cover:
    """The dimensions of the cover of one housing [mm]: the plate, its rim, and the level at which its foot ends."""

    housing: Housing
    foot_level: float
    plate: float = PLATE_MM
    recess: float = RECESS_MM
    setback: float = SETBACK_MM

    @property
    def thickness(self) -> float:
        """Return the thickness of plate and rim together [mm]."""
        return self.plate + self.recess

    @property
    def grip(self) -> float:
        """Return what the screws must span: the housing between two covers [mm]."""
        return self.housing.depth + 2.0 * self.thickness


def cover_of(sensor: Sensor) -> Cover:
    """Return the cover whose foot stays above the frame's lower edge in every tilt that the frame is made for."""
    rise = (PLATE_MM + RECESS_MM) * math.tan(math.radians(steepest(sensor.press)))
    return Cover(housing=sensor.housing, foot_level=round(sensor.housing.protrusion + rise, 3))


def cover_part(cover: Cover) -> Part:
    """Return the back cover as one solid with the faces `rim` and `mounting_holes`."""
    housing, inner = cover.housing, 0.5 * cover.housing.depth
    width, height = housing.right - housing.left, housing.top_level - cover.foot_level
    outside = cq.Vector(housing.left, inner, cover.foot_level)
    plate = cq.Workplane(obj=cq.Solid.makeBox(width, cover.thickness, height, outside))
    wall, reach = housing.wall_width - cover.setback, housing.cavity_level + cover.setback - cover.foot_level
    corner = cq.Vector(housing.left + wall, inner - cover.recess, cover.foot_level - cover.recess)
    if cover.recess > 0.0:
        inside = cq.Solid.makeBox(width - 2.0 * wall, 2.0 * cover.recess, reach + cover.recess, corner)
        plate = plate.cut(cq.Workplane(obj=inside))
    back = cq.Workplane("XZ", origin=(0.0, inner + cover.thickness + 1.0, 0.0))
    drill = back.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter).extrude(cover.thickness + 2.0)
    return named_part(
        "cover",
        plate.cut(drill).findSolid().Solids()[0],
        {
            "rim": lambda face: face.geomType() == "PLANE" and face.BoundingBox().ymax < inner + _NEAR,
            "mounting_holes": lambda face: face.geomType() == "CYLINDER",
        },
    )


def turned(shape: cq.Shape, housing: Housing) -> cq.Shape:
    """Return a cover turned from one side of the housing to the other, about the upright line in its middle [mm]."""
    middle = 0.5 * (housing.left + housing.right)
    return shape.rotate(cq.Vector(middle, 0.0, 0.0), cq.Vector(middle, 0.0, 1.0), 180.0)


def cover_findings(sensor: Sensor, cover: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.cover_clearance, _holes and _over_fruit [mm] of a back cover, made or read, and its turned copy.

    Clearance is that of shuttles, necks and leaves at rest, half way and at their stops.
    """
    sides = {"back": cover, "front": turned(cover, sensor.housing)}
    return (
        _clearance(sensor, sides, process),
        _holes(sensor, sides),
        fruit_finding("geometry.cover_over_fruit", sensor, cq.Compound.makeCompound(list(sides.values()))),
    )


def _clearance(sensor: Sensor, sides: dict[str, cq.Shape], process: Process) -> Verdict:
    name = "geometry.cover_clearance"
    moved = list(_moved(sensor))
    found = [(float(shape.distance(arm)), side, way) for way, arm in moved for side, shape in sides.items()]
    distance, side, way = min(found)
    reference = f"least distance of what moves from a cover: {side}, {way}; {process.name}"
    return at_least(name, distance, process.min_gap_mm, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _moved(sensor: Sensor) -> Iterator[tuple[str, cq.Shape]]:
    """Yield both arms, moved as a whole towards their stops: that is farther than any leaf of them goes."""
    housing = sensor.housing
    stops = (housing.cavity_level - housing.low_top_level, housing.cavity_level - housing.high_top_level)
    for arm, stop in zip(moving_parts(sensor), stops, strict=True):
        for share in _STEPS:
            yield f"{100.0 * share:g} % of the way to the stop", arm.translate(cq.Vector(0.0, 0.0, share * stop))


def _holes(sensor: Sensor, sides: dict[str, cq.Shape]) -> Verdict:
    """Return how far a hole of a cover is off that of the housing: its axis, or its radius."""
    name, limit = "geometry.cover_holes", len(sensor.housing.holes)
    wanted = _cylinders(sensor.part.shape.Faces()[index] for index in sensor.part.faces["mounting_holes"])
    off = 0.0
    for side, shape in sides.items():
        found = _cylinders(face for face in shape.Faces() if face.geomType() == "CYLINDER")
        if not len(found) == len(wanted) == limit:
            reference = f"{len(found)} holes in the {side} cover, {len(wanted)} in the housing: must be {limit} each"
            return failed(name, 0.0, unit="mm", reference=reference)
        off = max(off, float(np.abs(np.subtract(found, wanted)).max()))
    reference = f"axes and radii of {limit} holes in each cover against the housing's"
    return equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _cylinders(faces: Iterator[cq.Face]) -> list[tuple[float, float, float]]:
    """Return x and z of the axis and the radius of upright holes, in order of their places."""
    boxes = (face.BoundingBox() for face in faces)
    return sorted((round(box.center.x, 6), round(box.center.z, 6), round(0.5 * box.xlen, 6)) for box in boxes)

"""The bodies of the pictures: the part as it is printed, and everything that is put together, drawn apart."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from cad.design.parameters import Design
from cad.files.stl import coarse_triangles, read_stl
from cad.parts.assembly import (
    COVER_COLOUR,
    HEAD_HEIGHT_MM,
    HEAD_MM,
    NUT_ACROSS_FLATS_MM,
    NUT_MM,
    SCREW_MM,
    WASHER_THICKNESS_MM,
    dowel_length,
    screw_length,
)
from cad.parts.cover import WASHER_MM, Cover, cover_level
from cad.parts.cover_solid import cover_part
from cad.parts.fruit import bare_fruit
from cad.parts.housing import DOWEL_MM, Housing
from cad.parts.pin_socket import pins
from cad.parts.pose import sensor_pose
from cad.parts.sensor import STEEL_COLOUR, Body
from pipeline.report.page.drawing.picture import Label, Picture, pixel_picture
from pipeline.report.page.solid_pictures import SolidPictures
from pipeline.report.page.solid_view import Facets, Floats, Rendering, rendered, view_of

_EYE = (0.55, -1.0, 0.55)
_EYE_APART = (0.95, -1.0, 0.6)
_WIDTH = 760
_APART = 14.0  # [mm] between the bodies that are drawn apart
_NUT_CORNERS_MM = NUT_ACROSS_FLATS_MM / math.cos(math.pi / 6.0)
_SIDES = 24
_HOUSING = (0.47, 0.57, 0.69)  # the housing's blue, so light that dark edges show
_FRUIT = (0.98, 0.78, 0.42)


def solid_pictures(design: Design, housing: Housing, folder: Path) -> SolidPictures:
    """Return the pictures of the part whose STL file a folder has; raises ValueError where it holds no triangles."""
    mesh = sensor_pose(read_stl(folder / "housing.stl"), housing.depth, back_up=housing.back_to_back)
    part = Facets(name="printed plate", corners=np.asarray(mesh.triangles, dtype=np.float64), colour=_HOUSING)
    return SolidPictures(part=_part_picture(housing, part), assembly=_exploded_picture(design, housing, part))


def _part_picture(housing: Housing, part: Facets) -> Picture:
    view = view_of([part], _EYE, _WIDTH)
    size = " x ".join(f"{length:.1f}" for length in np.ptp(part.corners.reshape(-1, 3), axis=0))
    tips = _tip_labels(housing, part, view.pixels_of)
    what = "one of two equal plates" if housing.back_to_back else "one piece"
    title = "The printed part"
    words = (f"{what}, {size} mm", f"The housing with its two springs and their tips, {what}, {size} mm.")
    return pixel_picture(rendered([part], view).pixels, tips, "part", title, words)


def _exploded_picture(design: Design, housing: Housing, part: Facets) -> Picture:
    """Return part, covers, screws, pins and fruit drawn apart."""
    bodies = list(_apart(design, part, housing))
    view = view_of(bodies, _EYE_APART, _WIDTH, margin=0.09)
    picture = rendered(bodies, view)
    labels = _labels(bodies, picture, view.size)
    names = ", ".join(dict.fromkeys(body.name for body in bodies))
    words = (f"drawn apart across the plate: {names}", f"Exploded view of {names}.")
    return pixel_picture(picture.pixels, labels, "assembly", "How it goes together", words)


def _tip_labels(housing: Housing, part: Facets, seen: Callable[[Floats], Floats]) -> tuple[Label, ...]:
    """Return labels of the tips, by the kind of their springs, below the part."""
    lowest = seen(part.corners.reshape(-1, 3))[:, 1].max()
    labels = []
    for arm in housing.arms:
        x, y, _ = seen(np.array([arm.centre, -0.5 * housing.tip_side, -housing.pin_out]))
        side = arm.sign * 120.0
        labels.append(Label(text=f"{arm.name} spring", x=x + side, y=min(lowest + 18.0, y + 90.0), at_x=x, at_y=y))
    return tuple(labels)


def _apart(design: Design, part: Facets, housing: Housing) -> Iterator[Facets]:
    """Yield every body, moved apart along the screws, the fruit away from the tips."""
    plates, half = _plates(part, housing), 0.5 * housing.stack
    outer = _APART * (0.5 if len(plates) > 1 else 0.0)
    yield from plates
    if housing.mount == "covers":
        cover = Cover(housing=housing, foot_level=cover_level(housing.protrusion, design.press))
        drawn = _facets(Body(name="cover", shape=cover_part(cover).shape, colour=COVER_COLOUR))
        # `cover_part` stands behind a single plate, of a square it stands behind the stack
        back = drawn.moved(0.0, half - 0.5 * housing.depth + outer + _APART, 0.0)
        yield from (back, _turned(back, housing))
        half, outer = half + cover.thickness, outer + _APART
    yield from _screws(housing, half, outer)
    for pin in pins(housing, design.tips).values():
        shape = _facets(Body(name="pin", shape=pin, colour=STEEL_COLOUR)).moved(0.0, 0.0, -_APART)
        yield from _plates(shape, housing)
    yield _fruit(design, 0.6 * _APART + housing.pin_out)


def _plates(part: Facets, housing: Housing) -> tuple[Facets, ...]:
    """Return the one plate, or both of a square with the back one turned half round the press axis."""
    if not housing.back_to_back:
        return (part,)
    first = part.moved(0.0, -0.5 * housing.spacing, 0.0)
    turned = Facets(name=part.name, corners=first.corners * np.array([-1.0, -1.0, 1.0]), colour=part.colour)
    return first.moved(0.0, -0.5 * _APART, 0.0), turned.moved(0.0, 0.5 * _APART, 0.0)


def _turned(body: Facets, housing: Housing) -> Facets:
    """Return a cover turned to the other side about the upright line in the middle of the housing."""
    middle = housing.left + housing.right
    corners = body.corners * np.array([-1.0, -1.0, 1.0]) + np.array([middle, 0.0, 0.0])
    return Facets(name=body.name, corners=corners, colour=body.colour)


def _screws(housing: Housing, half: float, outer: float) -> Iterator[Facets]:
    """Yield screws with washers and nuts, drawn out of the grip of twice `half` [mm], and dowels."""
    length = screw_length(2.0 * half) or math.ceil(2.0 * half + NUT_MM + 2.0 * WASHER_THICKNESS_MM)
    out = half + outer
    for x, z in housing.holes:
        yield _cylinder("screw", (x, -out - _APART, z), HEAD_MM, HEAD_HEIGHT_MM)
        yield _cylinder("screw", (x, -out - _APART + HEAD_HEIGHT_MM, z), SCREW_MM, float(length))
        yield _cylinder("washer", (x, -out - 0.3 * _APART, z), WASHER_MM, WASHER_THICKNESS_MM)
        yield _cylinder("washer", (x, out + 0.3 * _APART, z), WASHER_MM, WASHER_THICKNESS_MM)
        yield _cylinder("nut", (x, out + 0.8 * _APART, z), _NUT_CORNERS_MM, NUT_MM, sides=6)
    dowel = float(dowel_length(housing) or housing.stack)
    yield from (_cylinder("dowel", (x, -0.5 * dowel, z), DOWEL_MM, dowel) for x, z in housing.dowels)


def _cylinder(
    name: str, start: tuple[float, float, float], diameter: float, length: float, sides: int = _SIDES
) -> Facets:
    """Return a cylinder or prism along y from a place [mm]."""
    angle = 2.0 * math.pi * np.arange(sides) / sides
    ring = 0.5 * diameter * np.stack([np.cos(angle), np.zeros(sides), np.sin(angle)], axis=1)
    near, far = ring, ring + np.array([0.0, length, 0.0])
    near_next, far_next = np.roll(near, -1, axis=0), np.roll(far, -1, axis=0)
    middle = np.zeros_like(ring)
    sets = [
        (near, far, near_next),
        (near_next, far, far_next),
        (middle, near, near_next),
        (middle + np.array([0.0, length, 0.0]), far_next, far),
    ]
    corners = np.concatenate([np.stack(one, axis=1) for one in sets]) + np.array(start)
    return Facets(name=name, corners=corners, colour=STEEL_COLOUR)


def _fruit(design: Design, below: float) -> Facets:
    """Return the fruit that is solved, its apex below the tips by a way [mm]."""
    body = Body(name="fruit", shape=bare_fruit(design.fruit), colour=_FRUIT)
    return _facets(body).moved(-design.tips.offset_mm, 0.0, -below)


def _facets(body: Body) -> Facets:
    return Facets(name=body.name, corners=coarse_triangles(body.shape), colour=body.colour)


def _labels(bodies: list[Facets], picture: Rendering, size: tuple[int, int]) -> tuple[Label, ...]:
    """Return one label for each name, half of them in a row above the bodies and half below.

    A label leads to the first body of its name that is seen.
    """
    anchors: dict[str, tuple[float, float]] = {}
    for place, body in enumerate(bodies):
        anchor = None if body.name in anchors else picture.anchor(place)
        if anchor is not None:
            anchors[body.name] = anchor
    width, height = size
    by_level = sorted(anchors, key=lambda name: anchors[name][1])
    half = (len(by_level) + 1) // 2
    labels = []
    for row, level in ((by_level[:half], 26.0), (by_level[half:], height - 12.0)):
        for place, name in enumerate(sorted(row, key=lambda name: anchors[name][0])):
            x, y = anchors[name]
            labels.append(Label(text=name, x=(place + 0.5) * width / len(row), y=level, at_x=x, at_y=y))
    return tuple(labels)

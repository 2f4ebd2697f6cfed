"""Sizes of cover and bracket in the sheet, measured on their solids."""

import cadquery as cq
import pytest
from squares import RESIN, square_sensor, with_seats

from cad.fabrication.mount import FLANGE_HOLE_MM, bracket_solid
from cad.fabrication.part_sizes import bracket_sizes, cover_sizes
from cad.parts.cover_solid import cover_part
from cad.parts.part import is_hole
from cad.parts.pose import print_pose

DIGITS = 0.0051  # sizes are told to 0.01 mm


@pytest.fixture(scope="module", params=["pair", "pair with sensors", "square with sensors"])
def seated(request, sensor):
    if request.param == "pair":
        return sensor
    return with_seats(square_sensor() if request.param.startswith("square") else sensor, RESIN)


def numbers(sizes, what):
    """Return the numbers of all lines of that name, each list of places as pairs."""
    return [
        [[float(number) for number in place.replace(" x ", ", ").split(", ")] for place in row.size.split("; ")]
        for row in sizes
        if row.what == what
    ]


def hole_places(shape, diameter, across):
    """Return where the holes of a diameter are, from the left and the upper edge of a shape in the plane x, y or z."""
    box = shape.BoundingBox()
    centres = [face.Center() for face in shape.Faces() if is_hole(face, diameter)]
    top = getattr(box, f"{across}max")
    return sorted([centre.x - box.xmin, top - getattr(centre, across)] for centre in centres)


def has_edge(shape, point, outwards):
    """Return whether a shape ends at a point [mm] in a direction: from inside it to outside, or the other way round."""
    step = 0.02 * cq.Vector(*outwards)
    sides = [any(solid.isInside(cq.Vector(*point) + sign * step) for solid in shape.Solids()) for sign in (-1.0, 1.0)]
    return sides[0] is not sides[1]


def test_sizes_of_the_cover_are_those_of_its_file(seated):
    lying = print_pose(cover_part(seated.housing, seated.seats).shape)
    box = lying.BoundingBox()
    sizes = cover_sizes(seated)
    outer = numbers(sizes, "width x height x thickness with rim")[0][0]
    assert outer == pytest.approx([box.xlen, box.ylen, box.zlen], abs=DIGITS)
    places = numbers(sizes, "centres of the screw holes, from the left and the upper edge")[0]
    found = hole_places(lying, seated.housing.hole_diameter, "y")
    assert sorted(places) == [pytest.approx(place, abs=DIGITS) for place in found]
    posts, bar = (numbers(sizes, f"width of the rim on the {where}")[0][0][0] for where in ("posts", "bar"))
    in_rim = box.zmax - 0.5 * numbers(sizes, "height of the rim")[0][0][0]
    assert has_edge(lying, (box.xmin + posts, box.ymin + 1.0, in_rim), (1.0, 0.0, 0.0))
    assert has_edge(lying, (box.center.x, box.ymax - bar, in_rim), (0.0, 1.0, 0.0))
    for windows in numbers(sizes, "centres of windows, from the left and the upper edge"):
        width, tall = numbers(sizes, "windows, width x height")[0][0]
        ledge = box.zmin + numbers(sizes, "depth of a window to its ledges")[0][0][0]
        for x, y in ([box.xmin + left, box.ymax - down] for left, down in windows):
            assert has_edge(lying, (x, y + 0.5 * tall - 0.02, ledge), (0.0, 0.0, 1.0))
            for sign in (-1.0, 1.0):
                assert has_edge(lying, (x + sign * 0.5 * width, y, ledge - 0.02), (1.0, 0.0, 0.0))
                assert has_edge(lying, (x, y + sign * 0.5 * tall, ledge - 0.02), (0.0, 1.0, 0.0))


def test_sizes_of_the_bracket_are_those_of_its_solid(seated):
    bracket = bracket_solid(seated)
    box = bracket.BoundingBox()
    sizes = bracket_sizes(seated)
    width, height, _ = numbers(sizes, "upright plate, width x height with the flange x thickness")[0][0]
    flange = numbers(sizes, "plate under the flange, width x depth x thickness")[0][0]
    shift = numbers(sizes, "left edge of the plate under the flange, from the left edge of the upright")[0][0][0]
    across = max(width, shift + flange[0]) - min(0.0, shift)
    assert [across, height, flange[1]] == pytest.approx([box.xlen, box.zlen, box.ylen], abs=2.0 * DIGITS)
    screws, *window = numbers(sizes, "centres of the screw holes, from the left and the upper edge") + numbers(
        sizes, "centre of the window, from the left and the upper edge"
    )
    left = seated.housing.left
    found = [[x + box.xmin - left, down] for x, down in hole_places(bracket, seated.housing.hole_diameter, "z")]
    assert sorted(screws) == [pytest.approx(place, abs=DIGITS) for place in found]
    holes = numbers(sizes, "centres of the holes of the flange, from the left and the front edge of their plate")[0]
    centres = sorted([face.Center().x, face.Center().y] for face in bracket.Faces() if is_hole(face, FLANGE_HOLE_MM))
    placed = sorted([left + shift + x, box.ymin + y] for x, y in holes)
    assert placed == [pytest.approx(place, abs=2.0 * DIGITS) for place in centres]
    assert bool(window) is (
        seated.seats is not None and seated.housing.back_to_back is not None and seated.housing.mount == "covers"
    )

"""A point is inside a part exactly where the lengths of the design say so.

Random lines through a part are cut by its faces. Points right before and behind each cut, and points at random between
them, are compared with formulas that share nothing with the constructor.
"""

from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from inside import inside_bracket, inside_coupon, inside_cover, inside_housing
from random_housings import housed_designs
from squares import RESIN, square_sensor, with_seats

from cad.checks.line_probe import solid_probe
from cad.fabrication.mount import bracket_solid
from cad.parts.assembly import finished_part
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_part
from sensor.design.processes import PROCESSES

BESIDE_MM = 1e-4  # of the points before and behind a face
ALONG = 40  # points at random on a line
LINES = 250  # through a part
NEAR_MM = 0.3  # of an edge: less than the radius of a fillet


def random_lines(shape, count, rng):
    """Yield lines in any direction with their spans inside a shape: half through the box around it, half near faces.

    Faces and edges take turns: of lines at random, one in a hundred meets a small pocket or a corner without a fillet.
    """
    around = corners_of(shape, 0.0)
    near = [*(corners_of(face, 0.0) for face in shape.Faces()), *(corners_of(edge, NEAR_MM) for edge in shape.Edges())]
    turns = rng.permutation(len(near))
    lines = solid_probe(shape)
    for number in range(count):
        start = rng.uniform(*(near[turns[number // 2 % len(near)]] if number % 2 else around))
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        yield start, direction, lines(tuple(start), tuple(direction))


def corners_of(shape, margin):
    """Return both ends of the box around a shape, wider by a margin on every side [mm]."""
    box = shape.BoundingBox()
    return np.array([box.xmin, box.ymin, box.zmin]) - margin, np.array([box.xmax, box.ymax, box.zmax]) + margin


def probes(shape, count, rng):
    """Return points (n, 3) near the surface of a shape and between, and whether each is inside."""
    points, is_inside = [], []
    for start, direction, spans in random_lines(shape, count, rng):
        ends = np.array([end for span in spans for end in span])
        beside = np.concatenate([ends - BESIDE_MM, ends + BESIDE_MM])
        reach = 20.0 + (np.abs(ends).max() if len(ends) else 0.0)
        along = np.concatenate([beside, rng.uniform(-reach, reach, ALONG)])
        crossed = np.searchsorted(ends, along)
        # A place right beside two faces, at an edge, is left to other lines.
        nearest = np.sort(np.abs(along[:, None] - ends), axis=1)[:, :2] if len(ends) else np.full((len(along), 2), 1e3)
        is_clear = (nearest[:, 1] > 2.0 * BESIDE_MM) & (nearest[:, 0] > 0.5 * BESIDE_MM)
        points.append(start + along[is_clear, None] * direction)
        is_inside.append(crossed[is_clear] % 2 == 1)
    return np.concatenate(points), np.concatenate(is_inside)


def disagreements(shape, inside, count=LINES, seed=3):
    """Return the points at which a shape and a formula disagree; the kernel's classifier has the last word."""
    points, is_inside = probes(shape, count, np.random.default_rng(seed))
    doubtful = points[inside(points) != is_inside]
    solid = shape.Solids()[0]
    said = inside(doubtful) if len(doubtful) else []
    return [point for point, by_formula in zip(doubtful, said, strict=True)
            if solid.isInside(cq.Vector(*point), 1e-7) != by_formula]  # fmt: skip


def parts_of(sensor):
    """Return by name each part as it is made, with the formulas of what lies inside it."""
    housing, seats = sensor.housing, sensor.seats
    return {
        "housing": (lambda: finished_part(housing, seats).shape, lambda points: inside_housing(housing, seats, points)),
        "cover": (lambda: cover_part(housing, seats).shape, lambda points: inside_cover(housing, seats, points)),
        "mount": (lambda: bracket_solid(sensor), lambda points: inside_bracket(sensor, points)),
        "coupon": (lambda: coupon_part(housing).shape, lambda points: inside_coupon(housing, points)),
    }


@pytest.mark.parametrize(
    ("seed", "count"), [pytest.param(1, 3, marks=pytest.mark.slow), pytest.param(2, 100, marks=pytest.mark.study)]
)
def test_a_point_is_inside_where_the_lengths_of_the_design_say(seed, count):
    for design, sensor in housed_designs(seed, count):
        for name, (draw, inside) in parts_of(sensor).items():
            assert disagreements(draw(), inside) == [], (design, name)


@pytest.fixture(scope="session")
def sensors(sensor, pinned):
    """Return sensors that have between them all that a constructor draws."""
    return {
        "pair": with_seats(replace(sensor, housing=replace(sensor.housing, mount="covers")), PROCESSES["fdm-petg"]),
        "pins": pinned,
        "square": with_seats(square_sensor(), RESIN),
    }


@pytest.mark.parametrize("kind", ["pair", "pins", "square"])
def test_parts_without_a_fault_agree(sensors, kind):
    for name, (draw, inside) in parts_of(sensors[kind]).items():
        assert disagreements(draw(), inside) == [], name

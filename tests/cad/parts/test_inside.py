"""A point is inside a part exactly where the lengths of the design say so; a planted fault of the constructor fails.

Random lines through a part are cut by its faces. Points right before and behind each cut, and points at random between
them, are compared with formulas that share nothing with the constructor.
"""

import functools
from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from inside import inside_bracket, inside_coupon, inside_cover, inside_housing
from random_housings import housed_designs
from squares import RESIN, square_sensor, with_seats

import cad.fabrication.mount
import cad.parts.assembly
import cad.parts.coupon_solid
import cad.parts.cover_solid
import cad.parts.housing_solid
import cad.parts.pin_socket
from cad.checks.line_probe import solid_lines
from cad.fabrication.mount import mount_solid
from cad.parts.assembly import finished_part
from cad.parts.coupon_solid import coupon_part
from cad.parts.cover_solid import cover_part
from cad.parts.hall_seats import HallSeats
from cad.parts.housing import Housing
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
    lines = solid_lines(shape)
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
        "mount": (lambda: mount_solid(sensor), lambda points: inside_bracket(sensor, points)),
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


@pytest.mark.parametrize(
    "kind", ["pair", pytest.param("pins", marks=pytest.mark.slow), pytest.param("square", marks=pytest.mark.slow)]
)
def test_parts_without_a_fault_agree(sensors, kind):
    for name, (draw, inside) in parts_of(sensors[kind]).items():
        assert disagreements(draw(), inside) == [], name


def changed(name, change):
    """Return a fault: a function of the constructor that takes another housing than it is given."""

    def plant(patch, module):
        right = getattr(module, name)
        patch.setattr(module, name, lambda *args: right(*(change(each) for each in args)))

    return plant


def constant(name, value):
    return lambda patch, module: patch.setattr(module, name, value)


def of(kind, **steps):
    """Return a function that changes a value of a kind by these steps [mm], and leaves all else as it is."""

    def change(value):
        if not isinstance(value, kind):
            return value
        return replace(value, **{key: getattr(value, key) + step for key, step in steps.items()})

    return change


of_housing = functools.partial(of, Housing)
of_seats = functools.partial(of, HallSeats)


def beside(name):
    """Return a fault: the first of the holes for screws, or for dowels, is drilled 0.1 mm beside its place."""

    def plant(patch, _):
        right = getattr(Housing, name).fget

        def moved(housing):
            (x, z), *others = right(housing)
            return ((x + 0.1, z), *others)

        patch.setattr(Housing, name, property(moved))

    return plant


def hole_left_out(patch, _):
    right = Housing.holes.fget
    patch.setattr(Housing, "holes", property(lambda housing: right(housing)[:3]))


def left_out(name):
    """Return a fault: a function that cuts a part returns it as it is."""
    return lambda patch, module: patch.setattr(module, name, lambda part, *_: part)


def one_corner_sharp(patch, module):
    right = module.fillet_corners
    patch.setattr(module, "fillet_corners", lambda housing: right(housing)[1:])


def smaller_fillets(patch, module):
    right = module.round_upright_edges
    patch.setattr(module, "round_upright_edges", lambda plate, corners, radius: right(plate, corners, 0.8 * radius))


def gable_down(patch, module):
    right = module.gable_side
    patch.setattr(module, "gable_side", lambda housing: -right(housing))


SOLID, PUT_TOGETHER, COVER = cad.parts.housing_solid, cad.parts.assembly, cad.parts.cover_solid
POCKETS = "cut_magnet_pockets"
FAULTS = {
    "shuttle too high": ("pair", "housing", SOLID, changed("profile", of_housing(low_top_level=0.05))),
    "frame too low": ("pair", "housing", SOLID, changed("profile", of_housing(protrusion=-0.05))),
    "one corner sharp": ("pair", "housing", SOLID, one_corner_sharp),
    "smaller fillets": ("pair", "coupon", cad.parts.coupon_solid, smaller_fillets),
    "neck of another slope": ("pair", "housing", SOLID, changed("_beside_tips", of_housing(neck_level=-0.3))),
    "tips at another spacing": ("pair", "housing", PUT_TOGETHER, changed("housing_part", of_housing(spacing=0.1))),
    "hole beside its place": ("pair", "housing", None, beside("holes")),
    "hole of a cover beside its place": ("pair", "cover", None, beside("holes")),
    "hole of a bracket beside its place": ("square", "mount", None, beside("holes")),
    "hole left out": ("pair", "cover", None, hole_left_out),
    "pocket left out": ("pair", "housing", PUT_TOGETHER, left_out(POCKETS)),
    "wider pocket": ("pair", "housing", PUT_TOGETHER, changed(POCKETS, of_seats(pocket_diameter=0.1))),
    "magnet beside its place": ("pair", "housing", PUT_TOGETHER, changed(POCKETS, of_seats(lower_disc=0.1))),
    "pocket too deep": ("square", "housing", PUT_TOGETHER, changed(POCKETS, of_seats(pocket_depth=0.1))),
    "window beside its place": ("pair", "cover", COVER, changed("_windows", of_seats(sensor=0.1))),
    "narrower window": ("square", "cover", COVER, changed("_windows", of_seats(window_width=-0.1))),
    "thicker ledge": ("pair", "cover", COVER, changed("_windows", of_seats(face_out=0.2))),
    "window without ledges": ("pair", "cover", COVER, constant("LEDGE_MM", 0.0)),
    "gable on the lower side": ("pins", "housing", cad.parts.pin_socket, gable_down),
    "no socket": ("pins", "housing", PUT_TOGETHER, left_out("cut_pin_sockets")),
    "wider socket": ("pins", "housing", PUT_TOGETHER, changed("cut_pin_sockets", of_housing(pocket_side=0.2))),
    "shallower socket": ("pins", "housing", PUT_TOGETHER, changed("cut_pin_sockets", of_housing(pocket_depth=-0.1))),
    "flat tip where a dome is": ("square", "housing", PUT_TOGETHER, left_out("cut_domes")),
    "dome of another radius": ("square", "housing", PUT_TOGETHER, changed("cut_domes", of_housing(dome_radius=0.5))),
    "dowel beside its place": ("square", "housing", None, beside("dowels")),
    "wider dowel hole": ("square", "housing", PUT_TOGETHER, changed("_with_pads", of_housing(dowel_hole=0.1))),
    "lower pad": ("square", "housing", PUT_TOGETHER, changed("_with_pads", of_housing(pad_height=-0.1))),
    "flange of M5": ("pair", "mount", cad.fabrication.mount, constant("FLANGE_HOLE_MM", 5.5)),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_constructor_is_found(sensors, fault, monkeypatch):
    kind, part, module, plant = FAULTS[fault]
    cad.parts.housing_solid.housing_part.cache_clear()
    draw, inside = parts_of(sensors[kind])[part]
    with monkeypatch.context() as patch:
        plant(patch, module)
        shape = draw()
    cad.parts.housing_solid.housing_part.cache_clear()
    assert disagreements(shape, inside, count=4 * LINES) != []

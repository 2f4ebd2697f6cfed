"""Seats of a Hall read-out: pockets for magnets in the shuttles, windows for sensors in the cover."""

from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from squares import RESIN, gentle, hall_square, square_housing, square_sensor, with_seats

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file
from cad.checks.seat_checks import pocket_verdicts, window_verdicts
from cad.files.stl import write_stl
from cad.parts.assembly import cover_locations, draw_sensor, plate_locations
from cad.parts.cover import RECESS_MM
from cad.parts.cover_solid import cover_part
from cad.parts.pose import print_pose
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.readout import PROBE, Readout
from sensor.theory.leaf_spring import pair_stiffness

PETG = PROCESSES["fdm-petg"]
CLEARANCE = 2.0 * RESIN.accuracy_mm
K_TOLERANCE = 1e-3  # of K_l and K_h, relative
FLOOR_MM = 1.5  # 2.5 mm from the magnets less the recess of 1 mm


def near_square():
    """Return a square whose tips leave no wall between two windows: 4.2 mm apart."""
    design = gentle(side_mm=3.6, spacing_mm=4.2)
    return with_seats(square_sensor(square_housing(design), design), RESIN)


@pytest.fixture(scope="module")
def pair(sensor):
    return with_seats(sensor, PETG)


def test_only_a_read_out_has_seats():
    design, housing = Design(), square_housing()
    assert draw_sensor(design, housing).seats is None
    assert draw_sensor(replace(design, readout=Readout()), housing).seats is not None
    plain = square_sensor()
    assert pocket_verdicts(plain) == ()
    assert window_verdicts(plain) == ()


def test_pockets_and_windows_pass_with_their_walls():
    """The thinnest walls: between two pockets, 3 mm apart; under a sensor, or beside a window, whichever is less."""
    sensor = hall_square()
    (pockets,) = pocket_verdicts(sensor)
    assert pockets.passed is True
    assert pockets.value == pytest.approx(PROBE.magnets_apart_mm - PROBE.magnet_mm - CLEARANCE, abs=1e-6)
    assert pockets.limit == RESIN.min_wall_mm
    (windows,) = window_verdicts(sensor)
    assert windows in cover_verdicts(sensor, cover_part(sensor.housing, sensor.seats).shape, RESIN)
    between = sensor.housing.spacing - PROBE.package_width_mm - CLEARANCE
    assert windows.passed is True
    assert windows.value == pytest.approx(min(FLOOR_MM, between), abs=1e-6)


@pytest.mark.parametrize("kind", ["square", "pair"])
def test_magnets_face_their_sensor_through_the_window(kind, pair):
    """A sensor of the package's size stands 2.5 mm before the discs, on the ledges, and meets nothing.

    Its middle is half the travel above that of both discs.
    """
    sensor = hall_square() if kind == "square" else pair
    housing, seats = sensor.housing, sensor.seats
    assert 0.5 * (seats.upper_disc + seats.lower_disc) - seats.sensor_level == pytest.approx(
        0.5 * sensor.press.travel_mm
    )
    front = cover_part(housing, seats).shape.moved(plate_locations(housing)[0].inverse * cover_locations(housing)[0])
    size = (PROBE.package_width_mm, PROBE.package_thickness_mm, PROBE.package_height_mm)
    for arm in housing.arms:
        middle = (
            arm.centre,
            -0.5 * housing.depth - PROBE.face_out_mm - 0.5 * PROBE.package_thickness_mm,
            housing.top_level - seats.sensor_level,
        )
        body = cq.Workplane().box(*size).val().translate(cq.Vector(*middle))
        assert sum(solid.Volume() for solid in body.intersect(front).Solids()) == pytest.approx(0.0, abs=1e-9)
        assert body.distance(front) == pytest.approx(0.0, abs=1e-9)
        assert body.distance(sensor.part.shape) == pytest.approx(PROBE.face_out_mm, abs=1e-6)


def test_one_window_takes_two_sensors_that_stand_too_near():
    sensor = near_square()
    assert sensor.housing.spacing - PROBE.package_width_mm - CLEARANCE < RESIN.min_wall_mm
    assert len(sensor.seats.windows) == 1
    (verdict,) = window_verdicts(sensor)
    assert (verdict.passed, verdict.value) == (True, pytest.approx(FLOOR_MM, abs=1e-6))
    assert pocket_verdicts(sensor)[0].passed is True


THIN = 0.9 * RESIN.min_wall_mm
SHUTTLE = PLATE = 5.6  # [mm] width of a shuttle and depth of a plate of the gentle square
SPACING = 6.0  # [mm] of its tips


@pytest.mark.parametrize(
    ("judge", "housing", "seats", "value"),
    [
        (pocket_verdicts, {}, {"pocket_diameter": PROBE.magnets_apart_mm - THIN}, THIN),
        (pocket_verdicts, {}, {"pocket_diameter": SHUTTLE - 2.0 * THIN, "lower_disc": 50.0}, THIN),
        (pocket_verdicts, {}, {"pocket_depth": PLATE - THIN, "is_pointed": False}, THIN),
        (pocket_verdicts, {}, {"pocket_depth": PLATE - THIN - 1.0, "pocket_diameter": 2.5}, THIN),  # a cone 1 mm high
        (window_verdicts, {}, {"face_distance": RECESS_MM + THIN}, THIN),
        (window_verdicts, {}, {"window_width": SPACING - THIN}, THIN),
        (window_verdicts, {"spacing": 0.99 * PROBE.package_width_mm, "shuttle_width": 3.0, "tip_side": 3.0}, {}, None),
    ],
)
def test_wall_thinner_than_the_process_prints_fails(judge, housing, seats, value):
    square = hall_square()
    assert (square.housing.shuttle_width, square.housing.depth) == (SHUTTLE, PLATE)
    changed = replace(square.housing, **housing)
    (verdict,) = judge(replace(square, housing=changed, seats=replace(square.seats, **seats)))
    assert (verdict.passed, verdict.value) == (False, None if value is None else pytest.approx(value, abs=1e-9))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["square", "pair"])
def test_seats_need_no_support(kind, pair, tmp_path):
    sensor = hall_square() if kind == "square" else pair
    housing = sensor.housing
    shapes = {
        "housing": print_pose(sensor.part.shape, back_up=housing.back_to_back is not None),
        "cover": print_pose(cover_part(housing, sensor.seats).shape),
    }
    for name, shape in shapes.items():
        write_stl(shape, tmp_path / f"{name}.stl")
        verdicts = {verdict.name: verdict for verdict in check_file(tmp_path / f"{name}.stl", RESIN)}
        assert verdicts["geometry.overhang"].passed is True
        assert verdicts["geometry.watertight"].passed is True


def test_pockets_move_no_stiffness_beyond_its_error(pair):
    """A shuttle bends by M (1 - 2 z / h) from leaf to leaf: where the pockets are, nearly nothing bends; it shears.

    The whole slab of a pocket's width and depth is taken from the section, for both pockets and between them.
    E = 2000 MPa, G = E / (2 (1 + 0.38)), shear factor 5/6; S. Timoshenko, Strength of Materials I, 1930, art. 34, 39.
    """
    E, G = 2000.0, 2000.0 / 2.76
    for sensor in (hall_square(), pair):
        housing, seats, flexure = sensor.housing, sensor.seats, sensor.housing.high
        width = housing.shuttle_width
        moment = 0.25 * flexure.length  # of a leaf of a spring under 1 N, F L / 4, at its root in the shuttle
        half = 0.5 * PROBE.magnets_apart_mm + 0.5 * seats.pocket_diameter
        cut = np.array([0.0, seats.pocket_diameter * seats.depth_at(0.0)])  # [mm^2] taken from the section
        second = width**3 * housing.depth / 12.0 - cut * seats.pocket_diameter**2 / 12.0
        give = 2.0 * half * (half**2 / 3.0 / (E * second) + 1.2 / (G * (width * housing.depth - cut)))
        added = (2.0 * moment / flexure.separation) ** 2 * (give[1] - give[0])
        K = pair_stiffness(E, flexure.depth, flexure.thickness, flexure.length)
        assert 0.0 < added * K < 0.1 * K_TOLERANCE

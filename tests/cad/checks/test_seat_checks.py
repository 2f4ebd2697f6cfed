"""Seats of a Hall read-out: pockets for magnets in the shuttles, windows for sensors in the cover."""

import itertools
import math
from dataclasses import replace

import cadquery as cq
import pytest
from squares import RESIN, gentle, hall_square, square_housing, square_sensor, with_seats

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file
from cad.checks.seat_checks import pocket_verdicts, window_verdicts
from cad.fabrication.mount import mount_solid
from cad.files.stl import write_stl
from cad.parts.assembly import sensor_of
from cad.parts.cover_solid import cover_part, turn_cover
from cad.parts.hall_seats import LEDGE_MM
from cad.parts.pose import print_pose
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.readout import PROBE, Readout
from sensor.theory.leaf_spring import pair_stiffness

PETG = PROCESSES["fdm-petg"]
CLEARANCE = 2.0 * RESIN.accuracy_mm
K_TOLERANCE = 1e-3  # of K_l and K_h, relative
FLOOR_MM = 1.5  # 2.5 mm from the magnets less the recess of 1 mm


def window_verdict(sensor, cover):
    verdicts = {verdict.name: verdict for verdict in cover_verdicts(sensor, cover, PETG)}
    assert all(verdict.passed for name, verdict in verdicts.items() if name != "geometry.sensor_windows")
    return verdicts["geometry.sensor_windows"]


def windows_alone(sensor, cover):
    (verdict,) = window_verdicts(sensor, turn_cover(cover, sensor.housing))
    return verdict


def near_square():
    """Return a square whose tips leave no wall between two windows: 4.2 mm apart."""
    design = gentle(side_mm=3.6, spacing_mm=4.2)
    return with_seats(square_sensor(square_housing(design), design), RESIN)


@pytest.fixture(scope="module")
def pair(sensor):
    return with_seats(sensor, PETG)


def test_only_a_read_out_has_seats():
    design, housing = Design(), square_housing()
    assert sensor_of(design, housing).seats is None
    assert sensor_of(replace(design, readout=Readout()), housing).seats is not None
    plain = square_sensor()
    assert pocket_verdicts(plain) == ()
    assert window_verdicts(plain, cover_part(plain.housing).shape) == ()


@pytest.mark.parametrize("kind", ["square", pytest.param("pair", marks=pytest.mark.slow)])
def test_pockets_and_windows_pass_with_their_walls(kind, pair):
    """The thinnest walls: between two pockets, 3 mm apart; under a sensor, or beside a window, whichever is less."""
    sensor, process = (hall_square(), RESIN) if kind == "square" else (pair, PETG)
    (pockets,) = pocket_verdicts(sensor)
    clearance = 2.0 * process.accuracy_mm
    assert pockets.passed is True
    assert pockets.value == pytest.approx(PROBE.magnets_apart_mm - PROBE.magnet_mm - clearance, abs=1e-6)
    assert pockets.limit == process.min_wall_mm
    windows = window_verdict(sensor, cover_part(sensor.housing, sensor.seats).shape)
    between = sensor.housing.spacing - PROBE.package_width_mm - clearance
    assert windows.passed is True
    assert windows.value == pytest.approx(min(FLOOR_MM, between), abs=1e-6)


def test_volumes_of_seats_are_those_of_their_shapes(pair):
    """A pocket is a cylinder, in a plate that is printed on its front with a blunt cone; a window a box and a slot."""
    square = hall_square()
    radius = 0.5 * (PROBE.magnet_mm + CLEARANCE)
    cylinder = math.pi * radius**2 * PROBE.magnet_height_mm
    cone = math.pi * (radius - 0.25) * (radius**2 + radius * 0.25 + 0.25**2) / 3.0
    taken = square_sensor().part.shape.Volume() - square.part.shape.Volume()
    assert taken == pytest.approx(4.0 * (cylinder + cone), rel=1e-6)
    width, height = PROBE.package_width_mm + CLEARANCE, PROBE.package_height_mm + CLEARANCE
    window = width * (0.5 * height + FLOOR_MM * (height - 2.0 * LEDGE_MM))
    for sensor in (square, pair):
        covers = [cover_part(sensor.housing, seats).shape.Volume() for seats in (None, sensor.seats)]
        assert covers[0] - covers[1] == pytest.approx(2.0 * window, rel=1e-6)


@pytest.mark.parametrize("kind", ["square", "pair"])
def test_magnets_face_their_sensor_through_the_window(kind, pair):
    """A sensor of the package's size stands 2.5 mm before the discs, on the ledges, and meets nothing."""
    sensor = hall_square() if kind == "square" else pair
    housing, seats = sensor.housing, sensor.seats
    front = turn_cover(cover_part(housing, seats).shape, housing)
    for arm in housing.arms:
        outer = -0.5 * housing.depth - PROBE.face_out_mm - PROBE.package_thickness_mm
        corner = cq.Vector(
            arm.centre - 0.5 * PROBE.package_width_mm,
            outer,
            housing.top_level - seats.sensor - 0.5 * PROBE.package_height_mm,
        )
        body = cq.Solid.makeBox(PROBE.package_width_mm, PROBE.package_thickness_mm, PROBE.package_height_mm, corner)
        assert sum(solid.Volume() for solid in body.intersect(front).Solids()) == pytest.approx(0.0, abs=1e-9)
        assert body.distance(front) == pytest.approx(0.0, abs=1e-9)
        assert body.distance(sensor.part.shape) == pytest.approx(PROBE.face_out_mm, abs=1e-6)


def test_one_window_takes_two_sensors_that_stand_too_near():
    sensor = near_square()
    housing, seats = sensor.housing, sensor.seats
    assert housing.spacing - PROBE.package_width_mm - CLEARANCE < RESIN.min_wall_mm
    cover = cover_part(housing, seats).shape
    verdict = windows_alone(sensor, cover)
    assert (verdict.passed, verdict.value) == (True, pytest.approx(FLOOR_MM, abs=1e-6))
    assert pocket_verdicts(sensor)[0].passed is True
    height = PROBE.package_height_mm + CLEARANCE
    width = housing.spacing + PROBE.package_width_mm + CLEARANCE
    taken = cover_part(housing).shape.Volume() - cover.Volume()
    assert taken == pytest.approx(width * (0.5 * height + FLOOR_MM * (height - 2.0 * LEDGE_MM)), rel=1e-6)
    crowded = replace(sensor, housing=replace(housing, spacing=0.99 * PROBE.package_width_mm))
    assert windows_alone(crowded, cover).passed is False


def filled(part, *, fraction=1.0):
    """Return a shape with its first pocket filled from the front to a fraction of its depth."""
    sensor = hall_square()
    housing, seats = sensor.housing, sensor.seats
    middle = cq.Vector(housing.arms[0].centre, -0.5 * housing.depth, housing.top_level - seats.upper_disc)
    start = middle + cq.Vector(0.0, (1.0 - fraction) * seats.pocket_depth, 0.0)
    plug = cq.Solid.makeCylinder(0.5 * seats.pocket_diameter, 3.0, start, cq.Vector(0.0, 1.0, 0.0))
    return replace(part, shape=part.shape.fuse(plug))


def test_planted_faults_of_pockets_fail():
    square = hall_square()
    assert pocket_verdicts(replace(square, part=square_sensor().part))[0].passed is False
    for fraction in (1.0, 0.1):
        (verdict,) = pocket_verdicts(replace(square, part=filled(square.part, fraction=fraction)))
        assert (verdict.passed, verdict.value) == (False, None)
    shifted = replace(square, seats=replace(square.seats, upper_disc=square.seats.upper_disc + 0.1))
    assert pocket_verdicts(shifted)[0].passed is False
    wide = replace(square.seats, pocket_diameter=PROBE.magnets_apart_mm - 0.9 * RESIN.min_wall_mm)
    thin = sensor_with(square, wide)
    (verdict,) = pocket_verdicts(thin)
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.9 * RESIN.min_wall_mm, abs=1e-6))


def sensor_with(sensor, seats):
    """Return a sensor whose part has other seats."""
    from cad.parts.assembly import finished_part

    return replace(sensor, part=finished_part(sensor.housing, seats), seats=seats)


def test_planted_faults_of_windows_fail():
    """A ledge that is thinner than the process prints, a window that is not there, is shut, or lies elsewhere."""
    square = hall_square()
    housing, seats = square.housing, square.seats
    deep = replace(seats, face_out=1.0 + 0.9 * seats.least_wall)
    verdict = windows_alone(replace(square, seats=deep), cover_part(housing, deep).shape)
    assert (verdict.passed, verdict.value) == (False, pytest.approx(0.9 * seats.least_wall, abs=1e-6))
    shallow = cover_part(housing, replace(seats, face_out=seats.face_out + 0.2)).shape
    for wrong in (cover_part(housing).shape, shallow):
        verdict = windows_alone(square, wrong)
        assert (verdict.passed, verdict.value) == (False, None)
    for change in ({"sensor": seats.sensor + 0.1}, {"window_width": seats.window_width - 0.1}):
        verdict = windows_alone(square, cover_part(housing, replace(seats, **change)).shape)
        assert verdict.passed is False


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["square", "pair"])
def test_seats_need_no_support(kind, pair, tmp_path):
    sensor = hall_square() if kind == "square" else pair
    housing = sensor.housing
    shapes = {
        "housing": print_pose(sensor.part.shape, back_up=housing.back_to_back),
        "cover": print_pose(cover_part(housing, sensor.seats).shape),
    }
    for name, shape in shapes.items():
        write_stl(shape, tmp_path / f"{name}.stl")
        verdicts = {verdict.name: verdict for verdict in check_file(tmp_path / f"{name}.stl", RESIN)}
        assert verdicts["geometry.overhang"].passed is True
        assert verdicts["geometry.watertight"].passed is True


def test_bracket_behind_sensors_has_a_window_for_them():
    square, plain = hall_square(), square_sensor()
    seats, housing = square.seats, square.housing
    taken = mount_solid(plain).cut(mount_solid(square)).BoundingBox()
    level = housing.top_level - seats.sensor
    assert taken.zmin < level - 0.5 * seats.window_height < level + 0.5 * seats.window_height < taken.zmax
    assert taken.xmax > 0.5 * (housing.spacing + seats.window_width) > 0.0 > taken.xmin


def test_pockets_move_no_stiffness_beyond_its_error(pair):
    """A shuttle bends by M (1 - 2 z / h) from leaf to leaf: where the pockets are, nearly nothing bends; it shears.

    The whole slab of a pocket's width and depth is taken from the section, for both pockets and between them.
    E = 2000 MPa, G = E / (2 (1 + 0.38)), shear factor 5/6; S. Timoshenko, Strength of Materials I, 1930, art. 34, 39.
    """
    E, G = 2000.0, 2000.0 / 2.76
    for sensor in (hall_square(), pair):
        housing, seats = sensor.housing, sensor.seats
        flexure = housing.high
        h, width = flexure.separation, housing.shuttle_width
        moment = 0.25 * flexure.length  # of a leaf of a spring under 1 N, F L / 4, at its root in the shuttle
        deep = seats.depth_at(0.0)
        sections = {}
        for name, cut in (("whole", 0.0), ("cut", seats.pocket_diameter * deep)):
            area = width * housing.depth - cut
            second = width**3 * housing.depth / 12.0 - cut * seats.pocket_diameter**2 / 12.0
            sections[name] = (area, second)
        half = 0.5 * PROBE.magnets_apart_mm + 0.5 * seats.pocket_diameter
        added = 0.0
        for sign, (area, second) in itertools.chain([(1.0, sections["cut"]), (-1.0, sections["whole"])]):
            bending = (2.0 * moment / h) ** 2 * 2.0 * half**3 / 3.0 / (E * second)
            shear = (2.0 * moment / h) ** 2 * 2.0 * half * 1.2 / (G * area)
            added += sign * (bending + shear)
        K = pair_stiffness(E, flexure.depth, flexure.thickness, flexure.length)
        assert 0.0 < added * K < 0.1 * K_TOLERANCE

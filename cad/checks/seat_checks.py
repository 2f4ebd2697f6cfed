"""Verdicts on the walls around magnets and Hall sensors, computed from the dimensions of the design."""

from collections.abc import Mapping

from cad.checks.near_faces import PLACE_TOLERANCE_MM
from cad.parts.cover import RECESS_MM
from cad.parts.sensor import SensorSolids
from sensor.design.readout import PROBE
from sensor.verdict import Verdict, judge


def pocket_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.magnet_pockets, the verdict on the thinnest wall [mm] around a magnet pocket.

    The walls above and below the two pockets of a shuttle are not included, because they are millimetres thick in every
    design. Without a Hall read-out, an empty tuple is returned.
    """
    housing, seats = sensor.housing, sensor.seats
    if seats is None:
        return ()
    walls = {
        "between both pockets of a shuttle": seats.lower_disc - seats.upper_disc - seats.pocket_diameter,
        "beside a pocket": 0.5 * (housing.shuttle_width - seats.pocket_diameter),
        "behind a pocket": housing.depth - seats.depth_at(0.0),
    }
    return (_thinnest_wall_verdict("geometry.magnet_pockets", walls, seats.least_wall),)


def window_verdicts(sensor: SensorSolids) -> tuple[Verdict, ...]:
    """Return geometry.sensor_windows, the verdict on the thinnest wall [mm] of the cover around its sensor windows.

    The walls are under a sensor and between the windows. The verdict fails if the Hall sensors do not fit side by side.
    Without a Hall read-out, an empty tuple is returned.
    """
    housing, seats = sensor.housing, sensor.seats
    if seats is None:
        return ()
    name = "geometry.sensor_windows"
    if housing.spacing < PROBE.package_width_mm:
        # Each sensor is centred on the axis of its tip, and the two axes are `spacing` apart.
        reference = f"sensors {PROBE.package_width_mm:g} mm wide do not fit side by side, {housing.spacing:g} mm apart"
        return (judge(name, None, reference, limit=seats.least_wall),)
    # The wall is part of the plate of the cover, which begins at the height of its rim in front of the frame. The wall
    # ends at the marked face of the sensor, `face_distance` in front of the frame.
    walls = {"under a sensor": seats.face_distance - RECESS_MM}
    if len(seats.windows) > 1:  # otherwise one window holds both sensors
        walls["between both windows"] = housing.spacing - seats.window_width
    return (_thinnest_wall_verdict(name, walls, seats.least_wall),)


def _thinnest_wall_verdict(name: str, walls: Mapping[str, float], limit: float) -> Verdict:
    """Return the verdict on the thinnest wall, which must be at least `limit` [mm] thick.

    `walls` holds the thickness [mm] of each wall, keyed by its place.
    """
    place = min(walls, key=walls.__getitem__)
    reference = f"thinnest wall by the lengths of the design: {place}"
    return judge(name, walls[place], reference, limit=limit, tolerance=PLACE_TOLERANCE_MM)

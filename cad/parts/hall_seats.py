"""Seats of a Hall read-out: pockets for two magnets in each shuttle, and windows for the sensors in the cover."""

from dataclasses import dataclass

from cad.parts.housing import Housing
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.readout import PROBE
from sensor.design.tips import PressMotion

LEDGE_MM = 0.9  # height of each ledge that holds a sensor; a ledge of less than 1 mm prints without support
POINT_MM = 0.25  # radius of the flat end of a cone, which is not sharp because the CAD kernel cannot mesh an apex


@dataclass(frozen=True, kw_only=True)
class HallSeats:
    """Positions and sizes of the seats [mm]. Levels are measured downwards from the upper edge of the frame.

    The pockets at the levels `upper_disc` and `lower_disc` are in the front of the shuttle, y = -depth / 2, above its
    tip. If this face is down in print, each pocket ends in a cone of 45 degrees, which needs no support (`is_pointed`).

    The cover has a window for each sensor, or one window for both if the wall between two windows would be too thin.
    `windows` are the x coordinates of their centres, and `sensor_level` is the level of the sensors. Ledges hold the
    marked face of a sensor at the distance `face_distance` in front of the frame. `least_wall` is the thinnest wall
    that the process can print.
    """

    upper_disc: float
    lower_disc: float
    sensor_level: float
    pocket_diameter: float
    pocket_depth: float
    is_pointed: bool
    windows: tuple[float, ...]
    window_width: float
    window_height: float
    face_distance: float
    least_wall: float

    @property
    def disc_levels(self) -> tuple[float, float]:
        """Return the levels of both magnets below the upper edge of the frame [mm]."""
        return self.upper_disc, self.lower_disc

    def depth_at(self, radius: float) -> float:
        """Return the depth of a pocket, including its cone, at the distance `radius` from its axis [mm]."""
        if not self.is_pointed:
            return self.pocket_depth
        return self.pocket_depth + (0.5 * self.pocket_diameter - max(radius, POINT_MM))


def hall_seats(housing: Housing, press: PressMotion, process: Process) -> HallSeats:
    """Return the seats of a Hall read-out in a housing, with the two magnets of a shuttle centred between its leaves.

    In a press, the magnets move upwards by up to the travel. Before the press, the sensors are half the travel above
    the middle of the magnets, so that they are in the middle of this motion. Pockets and windows are wider than magnets
    and sensors by twice the accuracy of the process.
    """
    # Like all levels of seats, this level is measured downwards from the upper edge of the frame. It is equal in both
    # arms, because their leaves have the same levels.
    leaf_middle = housing.top_level - 0.5 * sum(housing.arms[0].levels)
    clearance = 2.0 * process.accuracy_mm  # the accuracy on each side
    windows = tuple(arm.centre for arm in housing.arms)  # x of their centres
    width = PROBE.package_width_mm + clearance
    if housing.spacing - width < process.min_wall_mm:
        # The wall between two windows would be too thin, so both sensors share one window in the middle.
        windows = (0.0,)
        width += housing.spacing
    return HallSeats(
        upper_disc=leaf_middle - 0.5 * PROBE.magnets_apart_mm,
        lower_disc=leaf_middle + 0.5 * PROBE.magnets_apart_mm,
        sensor_level=leaf_middle - 0.5 * press.travel_mm,
        pocket_diameter=PROBE.magnet_mm + clearance,
        pocket_depth=PROBE.magnet_height_mm,
        is_pointed=housing.back_to_back is not None,
        windows=windows,
        window_width=width,
        window_height=PROBE.package_height_mm + clearance,
        face_distance=PROBE.face_out_mm,
        least_wall=process.min_wall_mm,
    )


def required_seats(design: Design, housing: Housing) -> HallSeats | None:
    """Return the seats that the read-out of a design requires in a housing, or None if there is no read-out."""
    if design.readout is None:
        return None
    return hall_seats(housing, design.press, design.process)

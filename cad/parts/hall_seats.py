"""Seats of a Hall read-out: pockets for the two magnets of a shuttle, and a window in the cover for their sensor."""

from dataclasses import dataclass

from cad.parts.housing import Housing
from sensor.design.parameters import Design
from sensor.design.processes import Process
from sensor.design.readout import PROBE
from sensor.design.tips import Press

LEDGE_MM = 0.9  # height of both ledges under a sensor: under 1 mm, so that they need no support in print
POINT_MM = 0.25  # radius of the flat end of a cone: a kernel divides no tip into triangles


@dataclass(frozen=True, kw_only=True)
class HallSeats:
    """Places and sizes of the seats [mm]; levels count from the upper edge of the frame downwards.

    A pocket lies in the front y = -depth / 2 of the shuttle, over its tip. Where that face lies down in print, a cone
    of 45 degrees closes the pocket but for its end. A window goes through the cover for each sensor, or one for both
    where the wall between would be too thin. `windows` are their middles x. Ledges above and below hold the marked face
    of a sensor at `face_out` before the front of the frame.
    """

    upper_disc: float
    lower_disc: float
    sensor: float
    pocket_diameter: float
    pocket_depth: float
    is_pointed: bool
    windows: tuple[float, ...]
    window_width: float
    window_height: float
    face_out: float
    least_wall: float

    @property
    def discs(self) -> tuple[float, float]:
        """Return the levels of both magnets [mm]."""
        return self.upper_disc, self.lower_disc

    def depth_at(self, radius: float) -> float:
        """Return the depth [mm] of a pocket at a radius from its middle [mm]."""
        return self.pocket_depth + (0.5 * self.pocket_diameter - max(radius, POINT_MM) if self.is_pointed else 0.0)


def hall_seats(housing: Housing, press: Press, process: Process) -> HallSeats:
    """Return the seats in a housing: the magnets midway between the leaves, the sensor half the travel above them.

    Pockets and windows are wider than what they hold by twice the accuracy of the process.
    """
    middle = housing.top_level - 0.5 * sum(housing.arms[0].levels)
    clearance = 2.0 * process.accuracy_mm
    windows = tuple(arm.centre for arm in housing.arms)
    width = PROBE.package_width_mm + clearance
    if housing.spacing - width < process.min_wall_mm:
        windows = (0.0,)
        width += housing.spacing
    return HallSeats(
        upper_disc=middle - 0.5 * PROBE.magnets_apart_mm,
        lower_disc=middle + 0.5 * PROBE.magnets_apart_mm,
        sensor=middle - 0.5 * press.travel_mm,
        pocket_diameter=PROBE.magnet_mm + clearance,
        pocket_depth=PROBE.magnet_height_mm,
        is_pointed=housing.back_to_back is not None,
        windows=windows,
        window_width=width,
        window_height=PROBE.package_height_mm + clearance,
        face_out=PROBE.face_out_mm,
        least_wall=process.min_wall_mm,
    )


def seats_of(design: Design, housing: Housing) -> HallSeats | None:
    """Return the seats that a design's read-out needs in a housing; None without one."""
    if design.readout is None:
        return None
    return hall_seats(housing, design.press, design.process)

"""Where the two magnets of a shuttle lie, and the Hall sensor that reads them."""

from dataclasses import dataclass

from cad.parts.housing import Housing
from sensor.design.tips import Press

DISC_MM = 2.0  # diameter of a magnet
DISC_HEIGHT_MM = 1.0
SENSOR_OUT_MM = 2.5  # from the faces of both magnets to the sensor
_DISCS_APART_MM = 3.0  # as the sensitivity of sensor/design/electronics.toml takes it


@dataclass(frozen=True, kw_only=True)
class HallPlaces:
    """How far below the upper edge of the frame the middles of both magnets and of their sensor lie [mm]."""

    upper_disc: float
    lower_disc: float
    sensor: float


def hall_places(housing: Housing, press: Press) -> HallPlaces:
    """Return the positions of the magnets of a shuttle, midway between its leaves, and their sensor in the cover."""
    middle = housing.top_level - 0.5 * sum(housing.arms[0].levels)
    return HallPlaces(
        upper_disc=middle - 0.5 * _DISCS_APART_MM,
        lower_disc=middle + 0.5 * _DISCS_APART_MM,
        sensor=middle - 0.5 * press.travel_mm,
    )

"""The readings of a sensor with its springs as they are made."""

from cad.design.parameters import Design
from cad.parts.housing import mounting_error
from pipeline.reading.assessment import reading_assessment
from pipeline.reading.bruising import skin_pressures
from pipeline.reading.pressed_sensor import pressed_sensor
from pipeline.reading.readings import Readings
from pipeline.springs.fitted_springs import FittedSprings, tip_height_offsets
from solve.fruit.compliance import FruitCompliance


def assess_readings(design: Design, contact: FruitCompliance, springs: FittedSprings) -> Readings | None:
    """Return how good the readings of a design are, None where it does not ask.

    Raises InputError where a pose is outside the domain of contact, SolveError when a solve is not exact.
    """
    if design.reading is None:
        return None
    sensor = pressed_sensor(design, contact, springs.C, tip_height_offsets(springs, design.press.attitude))
    assessed = reading_assessment(sensor, design.reading)
    plates = _contrast_of_plates(springs) * max((row.sources.contrast_slope for row in assessed.moduli), default=0.0)
    return Readings(assessed=assessed, pressures=skin_pressures(sensor), plates=plates)


def _contrast_of_plates(springs: FittedSprings) -> float:
    """Return how far the high tips may stand out before the low ones by the mounting of two plates [mm]."""
    housing = springs.housing
    return 0.0 if housing is None else mounting_error(housing, springs.process.accuracy_mm).contrast_mm

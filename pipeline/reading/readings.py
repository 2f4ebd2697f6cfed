"""What a run says of readings: how good they are, and how hard the tips press the skin."""

from dataclasses import dataclass

from cad.design.parameters import Design
from pipeline.reading.assessment import ReadingAssessment, reading_assessment
from pipeline.reading.bruising import SkinPressure, skin_pressures
from pipeline.reading.pressed_sensor import pressed_sensor
from pipeline.stages.springs import FittedSprings, tip_leads
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True)
class Readings:
    """The assessment of a design's readings, and the pressure on the skin at each modulus."""

    assessed: ReadingAssessment
    pressures: tuple[SkinPressure, ...]


def assess_readings(design: Design, contact: FruitCompliance, springs: FittedSprings) -> Readings | None:
    """Return how good the readings of a design are, None where it does not ask.

    Raises InputError where a pose is outside the domain of contact, SolveError when a solve is not exact.
    """
    if design.reading is None:
        return None
    sensor = pressed_sensor(design, contact, springs.C, tip_leads(springs, design.press.attitude))
    return Readings(assessed=reading_assessment(sensor, design.reading), pressures=skin_pressures(sensor))

"""What a run says of readings: how good they are, and how hard the tips press the skin."""

from dataclasses import dataclass

from pipeline.reading.assessment import ReadingAssessment
from pipeline.reading.bruising import SkinPressure


@dataclass(frozen=True, kw_only=True)
class Readings:
    """The assessment of a design's readings, and the pressure on the skin at each modulus.

    `plates` is by how much E moves where the two plates of a square are mounted as far off as their holes allow, before
    the tips are zeroed on a hard plate [1]; 0 for one plate.
    """

    assessed: ReadingAssessment
    pressures: tuple[SkinPressure, ...]
    plates: float = 0.0

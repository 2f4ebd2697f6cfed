"""What a run returns: every number, verdict and error of a sensor, typed and frozen."""

from dataclasses import dataclass

from cad.design.parameters import Design
from cad.verdict import Verdict, all_passed
from pipeline.options import RunOptions
from pipeline.reading.readings import Readings
from pipeline.reading.sensor_read_out import SensorReadOut
from pipeline.response.characteristics import SpringBehaviour
from pipeline.response.scene_press import ScenePress
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.sizing import SpringSizing
from pipeline.storage.stopwatch import Seconds
from pipeline.verdicts.errors.sensor_errors import SensorErrors
from pipeline.verdicts.sensor import Judgement
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True)
class SolvedSensor:
    """A design with what is solved for its verdicts; `readings` are None where the design asks for none."""

    design: Design
    options: RunOptions
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    press: ScenePress
    readings: Readings | None


@dataclass(frozen=True, kw_only=True)
class JudgedSensor(SolvedSensor):
    """A solved design with its verdicts: those of the readings and of the judgement, and those on fabrication."""

    judgement: Judgement
    verdicts: tuple[Verdict, ...]

    @property
    def passed(self) -> bool | None:
        """Say whether every verdict passed; None when one is undecided and none failed."""
        return all_passed(self.verdicts)


@dataclass(frozen=True, kw_only=True)
class SensorResult(JudgedSensor):
    """A design with what each stage of its run has found; its verdicts have their remedies.

    `read_out` is what a finished sensor is read by. `seconds` are wall and processor seconds by stage. `left_out` says
    why a file of fields is not there.
    """

    behaviour: SpringBehaviour | None
    read_out: SensorReadOut
    errors: SensorErrors
    left_out: str | None
    seconds: Seconds

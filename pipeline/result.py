"""The result of a run: every number, verdict and error of a sensor, as an immutable record."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from pipeline.errors.error_records import LevelTargets
from pipeline.errors.sensor_errors import SensorErrors
from pipeline.errors.targets import SceneTargets
from pipeline.notebook import answer_html
from pipeline.options import RunOptions
from pipeline.reading.analysis import ReadingAccuracy
from pipeline.reading.pressed_sensor import PressedSensor, SampledPresses
from pipeline.reading.read_out import ReadingConstants
from pipeline.reading.reading_over_time import ReadingOverTime
from pipeline.response.scene_press import ScenePress
from pipeline.springs.behaviour_record import SpringBehaviour
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.sizing import SpringSizing
from pipeline.storage.plain import Plain
from pipeline.storage.stopwatch import Seconds
from sensor.design.parameters import Design
from sensor.record import Record
from sensor.verdict import Verdict, all_passed, judge
from sensor.words import OUTCOMES
from solve.fruit.compliance import FruitCompliance


class ReportData(Plain):
    """The data of report.json, with a short representation."""

    def __repr__(self) -> str:
        """Return the names of the keys, without their values."""
        return f"{type(self).__name__}({', '.join(self)})"


@dataclass(frozen=True, kw_only=True, repr=False)
class SensorResult(Record):
    """All results for a design, as returned by `run` and `evaluate`.

    Attributes
    ----------
    design : Design
        The design that was solved.
    options : RunOptions
        The options of the run.
    contact : FruitCompliance
        Compliance of the fruit under the tips: the matrix S [1/mm] with its errors. S / E is the compliance [mm/N].
    sizing : SpringSizing
        The springs that the targets require.
    springs : FittedSprings
        The springs as fitted to the housing: leaves, stiffness and strain with errors, or the reason why they cannot be
        printed.
    pressed : PressedSensor
        The sensor as it is pressed and read: design, contact and springs together.
    press : ScenePress
        Forces [N] and force ratio P [1] as functions of modulus and travel, with errors.
    tilted : SampledPresses or None
        Forces [N] at several tilts along the tips; None without `[reading]` or without a tilt.
    readings : ReadingAccuracy or None
        Error and uncertainty of the modulus that is read; None without `[reading]`.
    over_time : ReadingOverTime or None
        A press and its hold over time; None if the flesh does not relax.
    behaviour : SpringBehaviour or None
        Tilt, stiffening, frequency and crosstalk of the fitted springs; None if no housing is made.
    read_out : ReadingConstants
        The constants from which a modulus is computed, given the forces.
    reached : SceneTargets
        P_max and NL [1] in the scene of the design and for a level sensor.
    level : LevelTargets
        P_max and NL [1] of a level sensor on a flat fruit.
    paper : tuple of Verdict or None
        Verdicts on the paper's own springs; None if fruit or tips are not the paper's.
    verdicts : tuple of Verdict
        All verdicts on the design.
    passed : bool or None
        Whether all verdicts pass; None if one is undecided and none failed.
    errors : SensorErrors
        The error budget of each number, the data of `response.csv` with error bands, and with `fabrication` the
        scatter of prints.
    left_out : tuple of str
        Results that could not be solved or written after the verdicts, each with the reason.
    seconds : Seconds
        Wall and processor time of each stage [s].
    report : dict
        The data of `report.json`, even if no file was written.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> result.design.name
    'paper'
    >>> list(result.springs.springs)
    ['low', 'high']
    """

    options: RunOptions
    pressed: PressedSensor
    press: ScenePress
    readings: ReadingAccuracy | None
    tilted: SampledPresses | None
    over_time: ReadingOverTime | None
    reached: SceneTargets
    verdicts: tuple[Verdict, ...]
    paper: tuple[Verdict, ...] | None
    behaviour: SpringBehaviour | None
    read_out: ReadingConstants
    errors: SensorErrors
    left_out: tuple[str, ...] = ()
    seconds: Seconds
    report: Plain = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Wrap the data of the report, so that they have a short representation."""
        object.__setattr__(self, "report", ReportData(self.report))

    def __repr__(self) -> str:
        """Return the design's name and the outcomes of its verdicts, because all numbers would fill many screens."""
        outcomes = [verdict.passed for verdict in self.verdicts]
        counts = ", ".join(f"{outcomes.count(passed)} {word}" for passed, word in OUTCOMES.items())
        return f"{type(self).__name__}({self.design.name!r}: {counts})"

    def _repr_html_(self) -> str:
        """Return the answer, the verdicts, the springs and P as a function of the modulus as HTML for notebooks."""
        response = self.errors.reading.response
        return answer_html(
            self.design.name,
            self.verdicts,
            self.springs.springs,
            response.E[1:],  # the first modulus represents the softest possible fruit, which is only a limit
            response.P[1:, -1],
            self.design.fruit.E_MPa,
        )

    @property
    def design(self) -> Design:
        """Return the design that was solved."""
        return self.pressed.design

    @property
    def sizing(self) -> SpringSizing:
        """Return the springs as sized from the targets, or as given by the design."""
        return self.pressed.sizing

    @property
    def contact(self) -> FruitCompliance:
        """Return the compliance of the fruit under the tips."""
        return self.pressed.contact

    @property
    def springs(self) -> FittedSprings:
        """Return the springs as printed."""
        return self.pressed.springs

    @property
    def level(self) -> LevelTargets:
        """Return P_max and NL of a level sensor on flat fruit."""
        return self.reached.level

    @property
    def passed(self) -> bool | None:
        """Return whether every verdict passed; None if one is undecided and none failed."""
        return all_passed(self.verdicts)


def with_solids(verdicts: Sequence[Verdict], geometry: Sequence[Verdict]) -> tuple[Verdict, ...]:
    """Return the `verdicts` on a sensor with the verdicts on its solids, `geometry`, inserted after the group "print".

    If no solid was made, `geometry` is empty, and the failed verdict geometry.made is inserted instead.
    """
    after_print = 1 + max(i for i, verdict in enumerate(verdicts) if verdict.row.group == "print")
    if not geometry:
        geometry = [judge("geometry.made", None, "no housing was made, see printable.low and .high")]
    return (*verdicts[:after_print], *geometry, *verdicts[after_print:])

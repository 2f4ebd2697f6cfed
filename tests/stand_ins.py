"""Results of solves as the tests of the pipeline take them: reference numbers in the place of a solve."""

import functools
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from instrument.compress.specimens import Specimen
from pipeline.main_job import evaluate_sensor
from pipeline.options import RunOptions
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.reading.reading_over_time import reading_over_time
from pipeline.report.answer import every_section, summary
from pipeline.report.of_result import report_of_result
from pipeline.report.outputs import write_outputs
from pipeline.report.report import report_data
from pipeline.report.verdict_table import print_parts
from pipeline.result import SensorResult, with_solids
from pipeline.sensor import Sensor
from pipeline.springs.fitted_springs import FittedSprings, printable_leaves, springs_for
from pipeline.springs.leaf_lengths import FittedHousing
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.springs.spring import MadeSpring
from pipeline.storage.folder import output_folder
from pipeline.storage.stopwatch import Seconds
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.design.tips import PressMotion
from sensor.verdict import Verdict
from solve.contact.scene import LateralCompliance
from solve.error_estimate import SolveInfo
from solve.fruit.compliance import FruitCompliance
from solve.housing.stiffness import HousingStiffness

PETG = PROCESSES["fdm-petg"]
LENGTHS = (28.935, 14.76)  # [mm] leaves of the default design, low then high
DEFLECTIONS = (0.5, 0.11)  # [mm] of its springs at full travel
ERRORS = (4.5e-4, 7.4e-4)  # [1] of its stiffnesses
INFO = SolveInfo(method="reference", dofs=1, seconds=0.0, status="given")

# The paper's block, by two independent methods to 2e-5: tests/solve/fruit/test_split.py.
CONTACT = FruitCompliance(
    S=np.array([[0.766603, 0.010526], [0.010526, 0.766603]]), difference_error=1e-4, s11_error=1e-4, info=INFO
)
K_M_OVER_E = 1.0 / (0.766603 - 0.010526)  # [mm]
GOOD = Verdict(name="geometry.valid", value=1.0, unit="1", limit=1.0, tolerance=0.0, passed=True, reference="a solid")


def default_housing(design: Design | None = None, lengths: tuple[float, float] = LENGTHS) -> Housing:
    """Return the housing of a design with leaves of the lengths [mm]."""
    design = design or Design()
    return housing_for(design, PROCESSES[design.print.process], lengths, DEFLECTIONS)


def housing_stiffness(K: tuple[float, ...], **changes: object) -> HousingStiffness:
    """Return springs of the stiffnesses [N/mm] that do not disturb each other."""
    of_each = len(K)
    given = HousingStiffness(
        C=np.diag([1.0 / stiffness for stiffness in K]),
        error=ERRORS,
        strain_per_N=(1e-3,) * of_each,
        strain_error=(0.01,) * of_each,
        tilt_per_N=(0.0,) * of_each,
        weight_sag=(1e3,) * of_each,
        weight_sag_error=(1e-3,) * of_each,
        weight_sag_lengthwise=(0.0,) * of_each,
        info=INFO,
    )
    return replace(given, **changes)


def fitted_housing(housing: Housing, stiffness: HousingStiffness) -> FittedHousing:
    """Return a housing that a fit would have ended with."""
    return FittedHousing(housing=housing, stiffness=stiffness)


def sizing_of(design: Design, contact: FruitCompliance = CONTACT) -> SpringSizing:
    """Return the sizing of a design under the reference contact."""
    return spring_sizing(design, contact, RunOptions())


def springs_of(design: Design, *, made: bool = True, lengths: tuple[float, float] = LENGTHS) -> FittedSprings:
    """Return the springs of a design as if FE had found just their targets, or as if none could be made."""
    sizing, process = sizing_of(design), PROCESSES[design.print.process]
    targets = sizing.springs.stiffnesses
    bare = springs_for(design, sizing, "sized")
    if not made:
        rows = bare.printable.items()
        refused = {name: replace(verdict, passed=False, reason="leaf too long") for name, verdict in rows}
        return replace(bare, printable=refused, ideal=False)
    housing = housing_for(design, process, lengths, bare.deflections)
    fitted = fitted_housing(housing, housing_stiffness(targets))
    springs = {
        arm.name: MadeSpring(
            target=targets[i],
            K=targets[i],
            K_error=ERRORS[i],
            flexure=arm.flexure,
            root_strain=2e-3,
            root_strain_error=0.01,
            safety_factor=process.strain_limit / 2e-3,
            dofs=INFO.dofs,
            seconds=INFO.seconds,
        )
        for i, arm in enumerate(housing.arms)
    }
    printable = printable_leaves(design, sizing, lengths)
    return replace(bare, springs=springs, printable=printable, fitted=fitted, ideal=False)


def draw_sensor(design: Design, springs: FittedSprings | None = None) -> PressedSensor:
    """Return the sensor of a design on the reference contact, on springs as FE would have found them."""
    springs = springs or springs_of(design)
    return PressedSensor(design=design, contact=CONTACT, sizing=sizing_of(design), springs=springs)


def with_compliance(
    design: Design,
    contact: FruitCompliance,
    C: np.ndarray,
    sideways: LateralCompliance | None = None,
    height_offsets: tuple[float, ...] = (),
) -> PressedSensor:
    """Return a sensor on springs of which the compliance [mm/N] is all that is known."""
    springs = SimpleNamespace(
        C=C,
        sideways=sideways,
        ideal=True,
        ideal_offsets_mm=height_offsets,
        process=design.process,
        creep=design.process.creep,
    )
    return PressedSensor(design=design, contact=contact, sizing=None, springs=springs)


def result_of(design: Design | None = None, options: RunOptions | None = None, *, made: bool = True) -> SensorResult:
    """Return the result of a run whose contact and springs were not solved and whose solid was not looked at."""
    return _kept_result(design or Design(), options or RunOptions(), made=made)


def solved(pressed: PressedSensor, options: RunOptions | None = None, **stages: object) -> Sensor:
    """Return a sensor whose contact, springs and other stages are known."""
    sensor = Sensor(design=pressed.design, options=options or RunOptions())
    known = {name: getattr(pressed, name) for name in ("contact", "sizing", "springs")}
    vars(sensor).update(known, pressed=pressed, upright_springs=pressed.springs, **stages)
    return sensor


def fresh_result(design: Design, options: RunOptions, *, made: bool = True) -> SensorResult:
    """Return what `result_of` keeps after the first time, anew."""
    pressed = draw_sensor(design, springs_of(design, made=made))
    errors = solved(pressed, readings=None).errors  # without the scatter of prints, which is solved
    result = evaluate_sensor(solved(pressed, options, readings=None, over_time=None, errors=errors))
    seconds = Seconds(wall={"contact": 0.5, "total": 1.0}, cpu={"contact": 0.5, "total": 1.0})
    return replace(result, verdicts=with_solids(result.verdicts, (GOOD,) if made else ()), seconds=seconds)


def relaxing_result() -> SensorResult:
    """Return the result of a sensor whose fruit relaxes."""
    design = Design(fruit=Fruit(relaxation=((0.5, 1.0),)), press=PressMotion(speed_mm_per_s=0.5, hold_s=1.0))
    return replace(result_of(design), over_time=reading_over_time(draw_sensor(design)))


_kept_result = functools.cache(fresh_result)


def stored_report(result: SensorResult) -> dict[str, Any]:
    """Return the report of a result as it is read back."""
    return json.loads(json.dumps(report_data(report_of_result(result))))


def print_summary(result: SensorResult) -> None:
    """Print a result on one screen, as the command does."""
    print_parts(summary(stored_report(result), result.options.out or Path("outputs")))


def print_everything(result: SensorResult) -> None:
    """Print every table of a result, as the command does."""
    print_parts(every_section(stored_report(result)))


def specimen(travel, force, file="virtual.csv", time=None) -> Specimen:
    """Return a curve as if it were read of a file with a header."""
    return Specimen(
        file=file,
        name="1",
        travel=travel,
        force=force,
        time=time,
        lines=tuple(range(2, len(travel) + 2)),
        labels={"force": "force_N", "travel": "travel_mm", "time": "time_s"},
        notes=(),
    )


class StandInRun:
    """Stands for `pipeline.run`: writes a report where it is told, keeps what it was asked for, returns a result."""

    def __init__(self):
        """Pass every verdict, until told otherwise."""
        self.asked: list[tuple[Design, RunOptions]] = []
        self.passed: bool | None = True
        self.error: BaseException | None = None
        self.result = result_of()

    @property
    def designs(self):
        """Return the designs that were run."""
        return [design for design, _ in self.asked]

    def __call__(self, design, options, **_):
        """Run nothing, or raise inside the output folder."""
        verdicts = tuple(replace(verdict, passed=self.passed) for verdict in self.result.verdicts)
        pressed = replace(self.result.pressed, design=design)
        result = replace(self.result, pressed=pressed, options=options, verdicts=verdicts)
        with output_folder(options.out, force=options.force) as folder:
            result = replace(result, report=stored_report(result))
            (folder / "report.json").write_text(json.dumps(result.report), encoding="utf-8")
            if self.error is not None:
                raise self.error
        self.asked.append((design, options))
        return result


def write_paper(parent: Path) -> Path:
    """Write an output folder of a pair whose contact and springs stand in for solved ones; return its path."""
    folder = parent / "paper"
    folder.mkdir()
    write_outputs(result_of(None), folder)
    return folder

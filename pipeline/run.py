"""The main job: targets -> springs -> solids -> meshes -> solutions -> verdicts, each stage from result to result."""

from dataclasses import replace
from pathlib import Path

from cad.design.parameters import Design
from cad.design.tip_mount import plate_depth
from pipeline.options import RunOptions
from pipeline.page.page import page_of_run
from pipeline.reading.placed import refuse_unsolvable_presses
from pipeline.reading.sensor_read_out import sensor_read_out
from pipeline.reading.sensor_readings import assess_readings
from pipeline.remedies.sentences import with_remedies
from pipeline.report.outputs import write_outputs
from pipeline.result import JudgedSensor, SensorResult
from pipeline.stages.characteristics import solved_behaviour
from pipeline.stages.contact import fruit_compliance
from pipeline.stages.fabrication import make_fabrication
from pipeline.stages.fields import write_fields
from pipeline.stages.sizing import spring_sizing
from pipeline.stages.solids import write_solids
from pipeline.stages.springs import fit_springs, press_of_springs
from pipeline.storage.folder import output_folder
from pipeline.storage.stopwatch import Stopwatch
from pipeline.uncertainty.cause import assessed_sensor
from pipeline.uncertainty.sensor_errors import sensor_errors
from pipeline.verdicts.sensor import all_verdicts, judge


def run(design: Design, options: RunOptions | None = None) -> SensorResult:
    """Return the result of every stage; with `options.out` its files too, which appear whole or not at all.

    Raises InputError for a scene or a folder that cannot be used, MeshError or SolveError where a solve is not to be
    believed.
    """
    options = options or RunOptions()
    _refuse_before_solving(design)
    with output_folder(options.out, force=options.force) as folder:
        result = _stages(design, options, folder, Stopwatch())
        write_outputs(result, folder, None if options.out is None else page_of_run(result))
    return result


def judged(design: Design, options: RunOptions | None = None, *, solids: bool = True) -> JudgedSensor:
    """Return the verdicts of a run and what they follow from, without the sizes of errors and without files.

    Without `solids` none is drawn, so that geometry.made fails. Raises as `run`.
    """
    options = replace(options or RunOptions(), out=None)
    _refuse_before_solving(design)
    if not solids:
        return _judged(design, options, None, Stopwatch())
    with output_folder(None) as folder:
        return _judged(design, options, folder, Stopwatch())


def _refuse_before_solving(design: Design) -> None:
    """Raise InputError for a scene or a pose that cannot be solved, or tips that leave no plate."""
    refuse_unsolvable_presses(design)
    plate_depth(design, design.process)


def _judged(design: Design, options: RunOptions, folder: Path | None, timed: Stopwatch) -> JudgedSensor:
    """Return what the stages up to the verdicts find; without a folder for them, no solids and no fabrication."""
    contact = timed("contact", fruit_compliance, design, options)  # meshes and solves the fruit
    sizing = timed("sizing", spring_sizing, design, contact, options)  # closed form
    springs = timed("springs", fit_springs, design, sizing, options)  # meshes and solves the housing
    geometry = () if folder is None else timed("solids", write_solids, design, springs, folder)
    press = timed("response", press_of_springs, design, contact, springs)
    readings = timed("reading", assess_readings, design, contact, springs)  # where the design asks for it
    judgement = timed("verdicts", judge, design, contact, sizing, springs, geometry, press)
    making = () if folder is None else timed("fabrication", make_fabrication, design, springs, options, folder)
    return JudgedSensor(
        design=design,
        options=options,
        contact=contact,
        sizing=sizing,
        springs=springs,
        press=press,
        judgement=judgement,
        readings=readings,
        verdicts=all_verdicts(design, readings, judgement, making),
    )


def _stages(design: Design, options: RunOptions, folder: Path, timed: Stopwatch) -> SensorResult:
    found = _judged(design, options, folder, timed)
    contact, springs, press = found.contact, found.springs, found.press
    verdicts = timed("remedies", with_remedies, found)  # where some did not pass
    sensor = timed("mounts", assessed_sensor, design, contact, found.sizing, springs)
    errors = timed("errors", sensor_errors, sensor, found.judgement.reached, press, options, found.readings)
    return SensorResult(
        **{**vars(found), "verdicts": verdicts},
        behaviour=timed("behaviour", solved_behaviour, springs, press),
        read_out=timed("reading", sensor_read_out, design, contact, springs, press, found.readings),
        errors=errors,
        left_out=timed("fields", write_fields, design, contact, springs, press, options, folder),
        seconds=timed.seconds(),
    )

"""The main job: targets -> springs -> solids -> meshes -> solutions -> verdicts, each stage from result to result."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from cad.design.parameters import Design
from cad.design.tip_mount import plate_depth
from pipeline.options import RunOptions
from pipeline.reading.placed import refuse_unsolvable_presses
from pipeline.reading.sensor_read_out import sensor_read_out
from pipeline.reading.sensor_readings import assess_readings
from pipeline.report.fabrication import begin_fabrication, sideways_verdicts
from pipeline.report.fields import write_fields
from pipeline.report.outputs import write_outputs
from pipeline.report.page.page import begin_pictures, page_of_run
from pipeline.report.page.solid_pictures import SolidPictures
from pipeline.report.solids import begin_solids
from pipeline.response.characteristics import solved_behaviour
from pipeline.response.contact import fruit_compliance
from pipeline.result import JudgedSensor, SensorResult, SolvedSensor
from pipeline.springs.fitted_springs import fit_springs, press_of_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.folder import output_folder
from pipeline.storage.modeller.answer import Answer, known
from pipeline.storage.modeller.kept_files import Verdicts
from pipeline.storage.modeller.modeller import Modeller, ModellerProcess
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.errors.cause import assessed_sensor
from pipeline.verdicts.errors.sensor_errors import sensor_errors
from pipeline.verdicts.remedies.sentences import with_remedies
from pipeline.verdicts.sensor import all_verdicts, judge


def run(design: Design, options: RunOptions | None = None, *, modeller: Modeller | None = None) -> SensorResult:
    """Return the result of every stage; with `options.out` its files too, which appear whole or not at all.

    With files and no modeller given, solids are made in a process of their own beside the solves. Raises InputError
    for a scene or a folder that cannot be used, MeshError or SolveError where a solve is not to be believed.
    """
    options = options or RunOptions()
    _refuse_before_solving(design)
    timed, modeller = Stopwatch(), modeller or (Modeller() if options.out is None else ModellerProcess())
    with output_folder(options.out, force=options.force) as folder, modeller:
        solved, files = _solved(design, options, folder, modeller, timed)
        result = _stages(solved, files, folder, modeller, timed)
        write_outputs(result, folder, None if options.out is None else page_of_run(result, files.pictures.result()))
    return result


def judged(design: Design, options: RunOptions | None = None, *, solids: bool = True) -> JudgedSensor:
    """Return the verdicts of a run and what they follow from, without the sizes of errors and without files.

    Without `solids` none is drawn, so that geometry.made fails. Raises as `run`.
    """
    options, modeller, timed = replace(options or RunOptions(), out=None), Modeller(), Stopwatch()
    _refuse_before_solving(design)
    if not solids:
        return _judged(*_solved(design, options, None, modeller, timed), timed)
    with output_folder(None) as folder:
        return _judged(*_solved(design, options, folder, modeller, timed), timed)


def _refuse_before_solving(design: Design) -> None:
    """Raise InputError for a scene or a pose that cannot be solved, or tips that leave no plate."""
    refuse_unsolvable_presses(design)
    plate_depth(design, design.process)


class _Files(NamedTuple):
    """The verdicts on files that the modeller may still be writing, and the pictures that it draws."""

    solids: Answer[Verdicts] = known(())
    fabrication: Answer[Verdicts] = known(())
    pictures: Answer[SolidPictures] = known(SolidPictures())


def _solved(
    design: Design, options: RunOptions, folder: Path | None, modeller: Modeller, timed: Stopwatch
) -> tuple[SolvedSensor, _Files]:
    """Return what verdicts follow from; without a folder for them, no solids and no fabrication."""
    contact = timed("contact", fruit_compliance, design, options)  # meshes and solves the fruit
    sizing = timed("sizing", spring_sizing, design, contact, options)  # closed form
    springs = timed("springs", fit_springs, design, sizing, options, modeller)  # meshes and solves the housing
    files = _Files()
    if folder is not None:  # from here on the modeller draws, writes and checks the solids beside all that follows
        files = _Files(
            solids=timed("solids", begin_solids, design, springs, folder, modeller),
            fabrication=timed("fabrication", begin_fabrication, design, springs, options, folder, modeller),
            pictures=begin_pictures(design, springs.housing, folder, modeller),
        )
    solved = SolvedSensor(
        design=design,
        options=options,
        contact=contact,
        sizing=sizing,
        springs=springs,
        press=timed("response", press_of_springs, design, contact, springs),
        readings=timed("reading", assess_readings, design, contact, springs),  # where the design asks for it
    )
    return solved, files


def _judged(solved: SolvedSensor, files: _Files, timed: Stopwatch) -> JudgedSensor:
    """Return the verdicts on what was solved, and on the files as soon as the modeller has made them."""
    design, springs = solved.design, solved.springs
    across = timed("fabrication", sideways_verdicts, springs, solved.options)
    geometry = timed.answered("solids", files.solids)
    making = (*timed.answered("fabrication", files.fabrication), *across)
    judgement = timed("verdicts", judge, design, solved.contact, solved.sizing, springs, geometry, solved.press)
    verdicts = all_verdicts(design, solved.readings, judgement, making)
    return JudgedSensor(**vars(solved), judgement=judgement, verdicts=verdicts)


def _stages(solved: SolvedSensor, files: _Files, folder: Path, modeller: Modeller, timed: Stopwatch) -> SensorResult:
    design, options, contact, springs = solved.design, solved.options, solved.contact, solved.springs
    press, readings = solved.press, solved.readings
    sensor = timed("mounts", assessed_sensor, design, contact, solved.sizing, springs)
    behaviour = timed("behaviour", solved_behaviour, springs, press)
    read_out = timed("reading", sensor_read_out, design, contact, springs, press, readings)
    left_out = timed("fields", write_fields, design, contact, springs, press, options, folder)
    found = _judged(solved, files, timed)
    errors = timed("errors", sensor_errors, sensor, found.judgement.reached, press, options, readings)
    verdicts = timed("remedies", with_remedies, found)  # where some did not pass
    return SensorResult(
        **{**vars(found), "verdicts": verdicts},
        behaviour=behaviour,
        read_out=read_out,
        errors=errors,
        left_out=left_out,
        seconds=timed.seconds(modeller.cpu_seconds),
    )

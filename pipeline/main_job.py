"""The main job: targets -> springs -> solids -> meshes -> solutions -> verdicts, each stage from result to result."""

from dataclasses import replace

from pipeline.evaluate import (
    check_targets,
    complete_evaluation,
    evaluate,
    housed_sensor,
    refuse_unsolvable,
    with_file_verdicts,
    with_leaning_tips,
)
from pipeline.making.fabrication import begin_fabrication, sideways_verdicts
from pipeline.making.fields import write_fields
from pipeline.making.solids import SolidMaker
from pipeline.options import RunOptions, refuse_unmakeable
from pipeline.report.outputs import refuse_folder_of_a_run, write_outputs
from pipeline.report.page.page import prepare_page
from pipeline.result import SensorResult
from pipeline.storage.folder import output_folder
from pipeline.storage.stopwatch import Progress, Stopwatch, silent
from pipeline.storage.workers import cad_worker
from pipeline.verdicts.hints import with_hints
from sensor.design.parameters import Design
from sensor.turns import in_turn


@in_turn
def run(
    design: Design, options: RunOptions | None = None, *, beside: bool = True, progress: Progress = silent
) -> SensorResult:
    """Return the result of every stage; with `options.out` its files too, which appear whole or not at all.

    With files and `beside`, solids are made in a process of their own beside the solves. Raises InputError
    for a scene or a folder that cannot be used, MeshError or SolveError where a solve is not to be believed.
    `progress` is called with the stage that is worked on.
    """
    options = options or RunOptions()
    timed = Stopwatch(progress)
    refuse_unmakeable(design, options)
    refuse_unsolvable(design)
    if options.look:
        return look(design, options, timed)
    with (
        output_folder(options.out, force=options.force) as folder,
        cad_worker(beside and options.out is not None) as executor,
    ):
        # The solids are drawn and checked by a worker, as soon as a housing may be the last one.
        maker = SolidMaker(design, executor)
        sensor = housed_sensor(design, options, timed, maker.size)
        with timed.stage("solids"):
            solids = maker.files(sensor.springs.housing, sensor.springs.deflections)
        sensor = with_leaning_tips(sensor, options, timed)
        with timed.stage("fabrication"):
            fabrication = begin_fabrication(sensor, options, executor)

        checked = check_targets(sensor, options, timed=timed)
        result = complete_evaluation(checked, timed)
        with timed.stage("fields"):
            fields_left_out = write_fields(sensor, result.press, options, folder)
            if options.out is not None:
                prepare_page(result)  # while the solids are made
        with timed.stage("fabrication"):
            sideways = sideways_verdicts(sensor.springs, options)
        with timed.stage("solids"):
            geometry = solids.result().write_to(folder)
        with timed.stage("fabrication"):
            making = (*fabrication.result().write_to(folder), *sideways)
        verdicts = with_file_verdicts(result, geometry, making)
        result = replace(result, verdicts=verdicts, left_out=result.left_out + fields_left_out, seconds=timed.seconds())
        report = write_outputs(result, folder, page=options.out is not None)
    return replace(result, report=report)


def look(design: Design, options: RunOptions, timed: Stopwatch) -> SensorResult:
    """Return a rough answer, accurate to a few per cent, without solids and files of parts.

    Raises as `run`, and OutputError for the folder of a whole run.
    """
    if options.out is not None:
        refuse_folder_of_a_run(options.out)
    with output_folder(options.out, force=options.force) as folder:
        result = evaluate(design, options, timed=timed)
        result = replace(result, verdicts=with_hints(result.verdicts, design, result.springs, options))
        report = write_outputs(result, folder, page=options.out is not None)
    return replace(result, report=report)

"""The main job: solve a design stage by stage, from targets and springs to solids, and evaluate its verdicts."""

from collections.abc import Sequence
from dataclasses import replace

from pipeline.making.fabrication import begin_fabrication, sideways_verdicts
from pipeline.making.field_files import write_fields
from pipeline.making.solids import SolidMaker
from pipeline.options import RunOptions, check_can_be_made
from pipeline.report.of_result import report_of_result
from pipeline.report.outputs import refuse_folder_of_a_run, write_outputs
from pipeline.report.page.page import prepare_page
from pipeline.report.report import report_data
from pipeline.result import SensorResult, with_solids
from pipeline.sensor import Sensor
from pipeline.storage.folder import output_folder
from pipeline.storage.stopwatch import Progress, Stopwatch, ignore_progress
from pipeline.storage.workers import cad_worker
from pipeline.verdicts.hints import with_hints
from sensor.design.parameters import Design
from sensor.quantity import check_type
from sensor.turns import in_turn
from sensor.verdict import Verdict


@in_turn()
def run(
    design: Design, options: RunOptions | None = None, *, beside: bool = True, progress: Progress | None = None
) -> SensorResult:
    """Solve a design and evaluate its verdicts, and write all its files if `options.out` names a folder.

    Parameters
    ----------
    design : Design
        The design, for instance from `load_design`.
    options : RunOptions, optional
        The output folder, the accuracy, and further files. Without options, no file is written.
    beside : bool, optional
        Whether a separate process makes the solids while this process solves, if files are written.
    progress : callable, optional
        Function that is called with the name of each stage when it begins.

    Returns
    -------
    SensorResult
        Every number, verdict and error of the sensor. `passed` states whether all verdicts pass.

    Raises
    ------
    InputError
        If the scene cannot be solved, or the folder cannot be used.
    MeshError, SolveError
        If a mesh or a solution is unreliable. Both are subclasses of RuntimeError.
    ExportError
        If a file, when it is read back, differs from what was written. This is a subclass of ValueError.
    OSError, MemoryError, BrokenExecutor
        If the machine fails, for instance because the disk is full. The folder is then restored to its previous state.

    Examples
    --------
    >>> options = twintip.RunOptions(out=Path("outputs/rough"), look=True, tolerance=0.02)
    >>> result = twintip.run(twintip.load_design("paper"), options)
    >>> (options.out / "report.json").is_file()
    True
    """
    options = RunOptions() if options is None else options
    _check_arguments(design, options)
    stopwatch = Stopwatch(progress or ignore_progress)
    check_can_be_made(design, options)
    sensor = Sensor(design=design, options=options, timed=stopwatch)
    if options.look:
        return look(sensor)
    with (
        output_folder(options.folder, force=options.force) as folder,
        cad_worker(beside and options.out is not None) as executor,
    ):
        # A worker process makes and checks the solids while this process solves. The worker starts on each housing that
        # may be the final one.
        maker = SolidMaker(design, executor)
        # `begin_size` starts the solid of a housing, and returns a future of its size.
        sensor = replace(sensor, begin_solid=maker.begin_size)
        sensor.solve("contact", "sizing", "upright_springs")
        springs = sensor.upright_springs
        # The worker starts on the files of the parts here, and on the files for fabrication below. The results are
        # collected when everything else is solved, so that neither process waits.
        with stopwatch.stage("solids"):
            future_solids = maker.begin_files(springs.housing, springs.deflections)
        sensor.solve("springs")
        pressed = sensor.pressed
        with stopwatch.stage("fabrication"):
            future_fabrication = begin_fabrication(pressed, options, executor)

        result = evaluate_sensor(sensor)
        with stopwatch.stage("fields"):
            fields_left_out = write_fields(pressed, result.press, options, folder)
            if options.out is not None:
                prepare_page(result)  # costs no extra time, because the worker is still making the solids
        with stopwatch.stage("fabrication"):
            sideways_stiffness = sideways_verdicts(pressed.springs, options)
        with stopwatch.stage("solids"):
            solid_verdicts = future_solids.result().write_to(folder)
        with stopwatch.stage("fabrication"):
            fabrication_verdicts = (*future_fabrication.result().write_to(folder), *sideways_stiffness)
        verdicts = with_file_verdicts(result, solid_verdicts, fabrication_verdicts)
        result = replace(
            result, verdicts=verdicts, left_out=result.left_out + fields_left_out, seconds=stopwatch.seconds()
        )
        report = write_outputs(result, folder, page=options.out is not None)
    return replace(result, report=report)


def _check_arguments(design: object, options: object) -> None:
    """Raise InputError for the arguments of a run that are of another type, such as the name of a preset."""
    check_type("design", design, Design, "a Design", "load it, as in twintip.load_design('paper')")
    check_type("options", options, RunOptions, "RunOptions", "make them, as in twintip.RunOptions(out='outputs/mine')")


def look(sensor: Sensor) -> SensorResult:
    """Make a quick run of a sensor, without solids and without files of parts, and return its result.

    If the options of the sensor name a folder, `options.out`, the report is written to it. Raises the same errors as
    `run`, and OutputError if the folder holds the files of a whole run, which a quick run must not replace.
    """
    options = sensor.options
    if options.folder is not None:
        refuse_folder_of_a_run(options.folder)
    with output_folder(options.folder, force=options.force) as folder:
        result = evaluate_sensor(sensor)
        report = write_outputs(result, folder, page=options.out is not None)
    return replace(result, report=report)


@in_turn()
def evaluate(design: Design, options: RunOptions | None = None, *, progress: Progress | None = None) -> SensorResult:
    """Solve a design and evaluate its verdicts like `run`, but without solids, files and the verdicts on them.

    Parameters
    ----------
    design : Design
        The design, for instance from `load_design`.
    options : RunOptions, optional
        The accuracy of the solution. `options.out` is ignored.
    progress : callable, optional
        Function that is called with the name of each stage when it begins.

    Returns
    -------
    SensorResult
        Every number, verdict and error of the sensor, except the verdicts on its files.

    Raises
    ------
    InputError
        If the scene cannot be solved.
    MeshError, SolveError
        If a mesh or a solution is unreliable. Both are subclasses of RuntimeError.
    OSError, MemoryError
        If the machine fails, for instance because it runs out of memory.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> K_l = next(verdict for verdict in result.verdicts if verdict.name == "K_l")
    >>> round(K_l.value / K_l.limit, 2)
    1.0
    """
    options = RunOptions() if options is None else options
    _check_arguments(design, options)
    sensor = Sensor(design=design, options=options, timed=Stopwatch(progress or ignore_progress))
    result = evaluate_sensor(sensor)
    return replace(result, report=report_data(report_of_result(result)))


def evaluate_sensor(sensor: Sensor) -> SensorResult:
    """Solve all stages of a sensor that are not solved yet, and return their results, without verdicts on files.

    Hints for the user are attached to verdicts that did not pass. Raises the same errors as `evaluate`.
    """
    # These stages depend on each other in this order, so progress is reported for one stage after another.
    sensor.solve("contact", "sizing", "upright_springs", "springs")
    rough_note = (
        "A rough answer has no solid and no files for fabrication. Run with --tol 0.001 if you need these files."
    )
    return SensorResult(
        options=sensor.options,
        pressed=sensor.pressed,
        press=sensor.press,
        readings=sensor.readings,
        over_time=sensor.over_time,
        reached=sensor.reached,
        verdicts=with_hints(sensor.verdicts, sensor.design, sensor.springs, sensor.options),
        behaviour=sensor.behaviour,
        tilted=sensor.tilted,
        read_out=sensor.read_out,
        errors=sensor.errors,
        paper=sensor.paper,
        left_out=(rough_note,) if sensor.options.rough else (),
        seconds=sensor.timed.seconds(),
    )


def with_file_verdicts(
    result: SensorResult, solid_verdicts: Sequence[Verdict], fabrication_verdicts: Sequence[Verdict]
) -> tuple[Verdict, ...]:
    """Return the verdicts of a result together with the verdicts on its solids and on its fabrication.

    A layout without a housing has no solids and no fabrication, so its verdicts remain the same. Hints for the user are
    attached to verdicts that did not pass.
    """
    verdicts = result.verdicts
    if result.design.tips.tip_layout.has_housing:
        verdicts = (*with_solids(verdicts, solid_verdicts), *fabrication_verdicts)
    return with_hints(verdicts, result.design, result.springs, result.options)

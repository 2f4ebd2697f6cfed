"""The main job: targets -> springs -> solids -> meshes -> solutions -> verdicts, each stage from result to result."""

from dataclasses import replace

from cad.design.parameters import Design
from pipeline.evaluate import evaluate, refuse_unsolvable
from pipeline.options import RunOptions
from pipeline.report.fabrication import begin_fabrication, sideways_verdicts
from pipeline.report.fields import write_fields
from pipeline.report.outputs import write_outputs
from pipeline.report.page.page import begin_pictures, page_of_run
from pipeline.report.solids import begin_solids
from pipeline.response.contact import fruit_compliance
from pipeline.result import SensorResult, with_solids
from pipeline.springs.fitted_springs import fit_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.storage.folder import output_folder
from pipeline.storage.modeller.modeller import Modeller, ModellerProcess
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.hints import with_hints


def run(design: Design, options: RunOptions | None = None, *, modeller: Modeller | None = None) -> SensorResult:
    """Return the result of every stage; with `options.out` its files too, which appear whole or not at all.

    With files and no modeller given, solids are made in a process of their own beside the solves. Raises InputError
    for a scene or a folder that cannot be used, MeshError or SolveError where a solve is not to be believed.
    """
    options = options or RunOptions()
    timed = Stopwatch()
    refuse_unsolvable(design)
    modeller = modeller or (Modeller() if options.out is None else ModellerProcess())
    with output_folder(options.out, force=options.force) as folder, modeller:
        with timed.stage("contact"):  # meshes and solves the fruit
            contact = fruit_compliance(design, options)
        with timed.stage("sizing"):  # targets to stiffnesses, in closed form
            sizing = spring_sizing(design, contact, options)
        with timed.stage("springs"):  # meshes and solves the housing
            springs = fit_springs(design, sizing, options, modeller)

        # The solids are drawn, written and checked by the modeller, beside all that follows here.
        with timed.stage("solids"):
            solids = begin_solids(design, springs, folder, modeller)
        with timed.stage("fabrication"):
            fabrication = begin_fabrication(design, springs, options, folder, modeller)
        pictures = begin_pictures(design, springs.housing, folder, modeller)

        result = evaluate(design, options, contact=contact, sizing=sizing, springs=springs, timed=timed)
        with timed.stage("fields"):
            left_out = write_fields(design, contact, springs, result.press, options, folder)
        with timed.stage("fabrication"):
            sideways = sideways_verdicts(springs, options)
        geometry = timed.answered("solids", solids)
        making = (*timed.answered("fabrication", fabrication), *sideways)
        verdicts = with_solids(result.verdicts, geometry)
        verdicts = with_hints((*verdicts, *making), design, springs, options)
        seconds = timed.seconds(modeller.cpu_seconds)
        result = replace(result, verdicts=verdicts, left_out=left_out, seconds=seconds)
        write_outputs(result, folder, None if options.out is None else page_of_run(result, pictures.result()))
    return result

"""A look at a sensor: its answer and its page, known to percents, without solids and files of parts."""

from dataclasses import replace

from cad.design.parameters import Design
from pipeline.evaluate import evaluate
from pipeline.options import RunOptions
from pipeline.report.outputs import write_outputs
from pipeline.result import SensorResult
from pipeline.storage.folder import output_folder
from pipeline.storage.stopwatch import Stopwatch
from pipeline.verdicts.hints import with_hints


def look(design: Design, options: RunOptions, timed: Stopwatch) -> SensorResult:
    """Return the result without verdicts on solids, its files in `options.out`; raises as `run`."""
    with output_folder(options.out, force=options.force) as folder:
        result = evaluate(design, options, timed=timed)
        result = replace(result, verdicts=with_hints(result.verdicts, design, result.springs, options))
        write_outputs(result, folder, page=options.out is not None)
    return result

"""The solids of a sensor: files of the part and of the part over its fruit, and the verdicts on their geometry."""

from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path

from cad.parts.hall_seats import seats_of
from pipeline.making.cad_tasks import write_solids
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.storage.kept_files import Verdicts, begin_files
from pipeline.storage.workers import finished_future
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design
from sensor.design.sheets import SHEETS

_SHAPES = ("name", "fruit", "tips", "press")  # tables of the design that solids and their checks depend on


def begin_solids(design: Design, springs: FittedSprings, folder: Path, executor: Executor | None) -> Future[Verdicts]:
    """Begin to write STEP, STL and 3MF into the folder; the result is the geometry verdicts, none without a housing.

    Files are the same bytes every time, so those of an earlier run are written again at once, which needs no worker.
    The future raises OSError or ExportError.
    """
    housing = springs.housing
    if housing is None:
        return finished_future(())
    # Kept verdicts are those of the same inputs: whatever a check is judged from stands here.
    inputs = {
        "process": design.process,
        "design": {key: value for key, value in design_as_mapping(design).items() if key in _SHAPES},
        "housing": housing,
        "seats": seats_of(design, housing),
        "sheet": SHEETS.get(design.print.leaves),
        "deflections": springs.deflections,
    }
    write = partial(write_solids, design, housing, springs.deflections, folder)
    return begin_files("solids", inputs, write, folder, executor)

"""The stage that writes the solids of a sensor, as a part and as an assembly, and checks their geometry."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from functools import partial

from cad.kernel import draw_part_size
from cad.parts.hall_seats import required_seats
from cad.parts.housing import Housing, PartSize
from pipeline.making.cad_tasks import write_solids
from pipeline.storage.kept_files import KeptFiles, begin_files
from pipeline.storage.workers import finished_future, submit
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design

_INPUT_TABLES = ("name", "fruit", "tips", "press")  # tables of the design on which solids and their checks depend


class SolidMaker:
    """The maker of the solids of a design, which works in parallel with the solves if it has a worker process.

    The maker starts making the files of each housing that may be the final one. If another housing turns out to be the
    final one, the maker discards these files.
    """

    def __init__(self, design: Design, executor: Executor | None) -> None:
        """Store the design and the executor that runs the tasks; if it is None, they run in this process."""
        self._design = design
        self._executor = executor
        self._started: tuple[Housing, Future[KeptFiles]] | None = None

    def begin_size(self, housing: Housing, deflections: tuple[float, ...]) -> Future[PartSize]:
        """Start making the solid of a housing, and return a future of its size, with which its mesh is compared.

        `deflections` [mm] are the deflections of its springs at full travel, low then high. If there is a worker
        process, it also starts making the files of this housing, which may not be the final one.
        """
        size = submit(self._executor, draw_part_size, housing)
        if self._executor is not None:
            self.begin_files(housing, deflections)
        return size

    def begin_files(self, housing: Housing | None, deflections: tuple[float, ...]) -> Future[KeptFiles]:
        """Start making the files of a housing, unless they were started before, and return a future of them.

        `deflections` [mm] are the deflections of its springs at full travel, low then high. Files that were started for
        a different housing are cancelled. The files of an earlier run are read from the cache. If `housing` is None,
        there are no files.

        OSError is raised if a file cannot be written, and ExportError if the volume read back from it is wrong. If
        there is a worker process, the future raises them; otherwise this method raises them.
        """
        if self._started is not None:
            started_housing, started_files = self._started
            if started_housing == housing:
                return started_files
            started_files.cancel()  # these files belong to a housing that is not the final one
        if housing is None:
            return finished_future(KeptFiles())
        design = self._design
        tables = {key: value for key, value in design_as_mapping(design).items() if key in _INPUT_TABLES}
        # The cache key is computed from these inputs, so they must include everything that a check uses.
        inputs = {
            "process": design.process,
            "design": tables,
            "housing": housing,
            "seats": required_seats(design, housing),
            "deflections": deflections,
        }
        write = partial(write_solids, design, housing, deflections)
        files = begin_files("solids", inputs, write, self._executor)
        self._started = (housing, files)
        return files

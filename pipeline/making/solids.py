"""The files of a sensor's solids, as a part and as an assembly over its fruit, and the verdicts on their geometry."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from functools import partial

from cad.kernel import solid_size
from cad.parts.hall_seats import seats_of
from cad.parts.housing import Housing, PartSize
from pipeline.making.cad_tasks import write_solids
from pipeline.storage.kept_files import KeptFiles, begin_files
from pipeline.storage.workers import finished_future, submit
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design

_SHAPES = ("name", "fruit", "tips", "press")  # tables of the design that solids and their checks depend on


class SolidMaker:
    """The maker of the solids of a design, which works in parallel with the solves if it has a worker process.

    It begins the files of each housing that may be the final one, and discards those of a housing that is not.
    """

    def __init__(self, design: Design, executor: Executor | None) -> None:
        """Store the design, and the executor of the worker, or None to work in this process."""
        self._design = design
        self._executor = executor
        self._begun: tuple[Housing, Future[KeptFiles]] | None = None

    def size(self, housing: Housing, deflections: tuple[float, ...]) -> Future[PartSize]:
        """Begin to make the solid of a housing, and return the future of its size.

        `deflections` are those of its springs [mm]. A worker makes the files of this housing next, before the solves
        have determined whether it is the final one.
        """
        size = submit(self._executor, solid_size, housing)
        if self._executor is not None:
            self.files(housing, deflections)
        return size

    def files(self, housing: Housing | None, deflections: tuple[float, ...]) -> Future[KeptFiles]:
        """Begin to make the STEP, STL and 3MF files of a housing, unless that has begun, and return their future.

        Files of an earlier run are taken from the cache. Without a housing there are none. The future raises OSError if
        a file cannot be written, and ExportError if its content is wrong.
        """
        if self._begun is not None:
            if self._begun[0] == housing:
                return self._begun[1]
            self._begun[1].cancel()
        if housing is None:
            return finished_future(KeptFiles())
        design = self._design
        # These inputs are the key of the cache, so everything that a check uses must be among them.
        inputs = {
            "process": design.process,
            "design": {key: value for key, value in design_as_mapping(design).items() if key in _SHAPES},
            "housing": housing,
            "seats": seats_of(design, housing),
            "deflections": deflections,
        }
        write = partial(write_solids, design, housing, deflections)
        self._begun = (housing, begin_files("solids", inputs, write, self._executor))
        return self._begun[1]

"""The solids of a sensor: files of the part and of the part over its fruit, and the verdicts on their geometry."""

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
    """The maker of a design's solids, in a worker process in parallel with the solves if there is one.

    Files are begun for each housing that may be the last one. The files of a superseded housing are discarded.
    """

    def __init__(self, design: Design, executor: Executor | None) -> None:
        """Store the design and the worker."""
        self._design = design
        self._executor = executor
        self._begun: tuple[Housing, Future[KeptFiles]] | None = None

    def size(self, housing: Housing, deflections: tuple[float, ...]) -> Future[PartSize]:
        """Begin the solid of a housing for deflections of its springs [mm]; the future gives its size.

        A worker makes its files right after, before the solves decide whether this housing is the last one.
        """
        size = submit(self._executor, solid_size, housing)
        if self._executor is not None:
            self.files(housing, deflections)
        return size

    def files(self, housing: Housing | None, deflections: tuple[float, ...]) -> Future[KeptFiles]:
        """Begin STEP, STL and 3MF of a housing unless they are begun.

        The future gives the files, none without a housing.

        The cache may have them from an earlier run; otherwise a worker makes them. The future raises OSError or
        ExportError.
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

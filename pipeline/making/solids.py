"""The solids of a sensor: files of the part and of the part over its fruit, and the verdicts on their geometry."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from functools import partial
from typing import TYPE_CHECKING

from cad.parts.hall_seats import seats_of
from cad.parts.housing import Housing, PartSize, solid_size
from pipeline.making.cad_tasks import write_solids
from pipeline.result import SensorResult
from pipeline.storage.kept_files import KeptFiles, begin_files
from pipeline.storage.workers import finished_future, submit
from sensor.design.design_file import design_as_mapping
from sensor.design.parameters import Design
from sensor.quantity import validation_error
from sensor.turns import in_turn

if TYPE_CHECKING:
    import cadquery as cq

    from cad.parts.sensor import SensorSolids

_SHAPES = ("name", "fruit", "tips", "press")  # tables of the design that solids and their checks depend on


@in_turn
def housing(result: SensorResult) -> cq.Workplane:
    """Return the housing of a result [mm] on a CadQuery workplane.

    It is the solid of housing.step; a square has two equal plates, of which it is one. The axis x runs along the tips,
    whose faces lie at z = 0, and z points away from the fruit. Its faces `low_tip`, `high_tip`, `mounting_holes` and
    `side_faces` are tags. Raises InputError if the springs are not made.

    Parameters
    ----------
    result : SensorResult
        What `run` or `evaluate` returned.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> housing = twintip.housing(result)
    >>> housing.faces(tag="mounting_holes").size()
    4
    """
    part = _solids_of(result).part
    from cad.parts.assembly import on_workplane  # it loads the CAD kernel

    return on_workplane(part)


@in_turn
def cover(result: SensorResult) -> cq.Workplane:
    """Return the cover behind the housing of a result [mm] on a CadQuery workplane, in the frame of `housing`.

    It is the solid of cover.step, which is printed twice; the front cover is turned by half a turn. Its faces `rim` and
    `mounting_holes` are tags. Raises InputError if the springs are not made.

    Parameters
    ----------
    result : SensorResult
        What `run` or `evaluate` returned.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> twintip.cover(result).solids().size()
    1
    """
    sensor = _solids_of(result)
    from cad.parts.assembly import on_workplane
    from cad.parts.cover_solid import cover_part

    return on_workplane(cover_part(sensor.housing, sensor.seats))


@in_turn
def mount(result: SensorResult) -> cq.Workplane:
    """Return the bracket that carries the sensor of a result [mm] on a CadQuery workplane, in the frame of `assembly`.

    It is the solid of mount.step. Its faces `seat` (on the sensor), `flange`, `mounting_holes` and `flange_holes` are
    tags. Raises InputError if the springs are not made.

    Parameters
    ----------
    result : SensorResult
        What `run` or `evaluate` returned.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> twintip.mount(result).faces(tag="flange_holes").size()
    4
    """
    sensor = _solids_of(result)
    from cad.fabrication.mount import mount_part
    from cad.parts.assembly import on_workplane

    return on_workplane(mount_part(sensor))


@in_turn
def assembly(result: SensorResult) -> cq.Assembly:
    """Return the sensor of a result over its fruit [mm], before the press, as a CadQuery assembly.

    Its parts are those of assembly.step: `housing` or `plate_1` and `plate_2`, `front_cover`, `screw_1`, `fruit`. Each
    has its place, `loc`, and equal parts share one shape. Faces of housing and covers are tags. Raises InputError if
    the springs are not made.

    Parameters
    ----------
    result : SensorResult
        What `run` or `evaluate` returned.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> assembly = twintip.assembly(result)
    >>> [part.name for part in assembly.children][:3]
    ['housing', 'front_cover', 'back_cover']
    """
    sensor = _solids_of(result)
    from cad.parts.assembly import assembly_of

    return assembly_of(sensor)


def _solids_of(result: SensorResult) -> SensorSolids:
    """Return the solid sensor of a result; raises InputError if its springs are not made."""
    made = result.springs.housing
    if made is None:
        hint = "see the verdicts printable.low and printable.high; a line of tips has no housing"
        raise validation_error("housing", result.design.name, "", "of a design whose springs are made", hint)
    from cad.parts.assembly import sensor_of  # it loads the CAD kernel

    return sensor_of(result.design, made)


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

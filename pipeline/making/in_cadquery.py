"""The solids of a result as CadQuery objects, for `import twintip`. Importing this module loads the CAD kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cad.fabrication.mount import bracket_part
from cad.parts.assembly import assemble_sensor, draw_sensor, tagged_workplane
from cad.parts.cover_solid import cover_part
from pipeline.result import SensorResult
from sensor.quantity import validation_error
from sensor.turns import in_turn

if TYPE_CHECKING:
    import cadquery as cq

    from cad.parts.sensor import SensorSolids


@in_turn()
def housing(result: SensorResult) -> cq.Workplane:
    """Return the housing of a result [mm] as a CadQuery workplane.

    It is the solid in housing.step, in sensor coordinates. The x axis runs along the tips, whose faces lie at z = 0,
    and z points away from the fruit. A square of tips has two identical plates, and one of them is returned.

    Parameters
    ----------
    result : SensorResult
        The result of `run` or `evaluate`.

    Returns
    -------
    cadquery.Workplane
        The housing. Its faces `low_tip`, `high_tip`, `mounting_holes` and `side_faces` are tagged.

    Raises
    ------
    InputError
        If the springs of the design cannot be made.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> housing = twintip.housing(result)
    >>> housing.faces(tag="mounting_holes").size()
    4
    """
    return tagged_workplane(_solids_of(result).part)


@in_turn()
def cover(result: SensorResult) -> cq.Workplane:
    """Return the cover behind the housing of a result [mm] as a CadQuery workplane.

    It is the solid in cover.step, in the coordinates of `housing`. The cover is printed twice: the front cover is the
    same part, rotated by 180 degrees.

    Parameters
    ----------
    result : SensorResult
        The result of `run` or `evaluate`.

    Returns
    -------
    cadquery.Workplane
        The cover. Its faces `rim` and `mounting_holes` are tagged.

    Raises
    ------
    InputError
        If the springs of the design cannot be made.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> twintip.cover(result).solids().size()
    1
    """
    sensor = _solids_of(result)
    return tagged_workplane(cover_part(sensor.housing, sensor.seats))


@in_turn()
def mount(result: SensorResult) -> cq.Workplane:
    """Return the bracket that carries the sensor of a result [mm] as a CadQuery workplane.

    It is the solid in mount.step, in the coordinates of `assembly`.

    Parameters
    ----------
    result : SensorResult
        The result of `run` or `evaluate`.

    Returns
    -------
    cadquery.Workplane
        The bracket. Its faces `seat` (against the sensor), `flange`, `mounting_holes` and `flange_holes` are tagged.

    Raises
    ------
    InputError
        If the springs of the design cannot be made.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> twintip.mount(result).faces(tag="flange_holes").size()
    4
    """
    return tagged_workplane(bracket_part(_solids_of(result)))


@in_turn()
def assembly(result: SensorResult) -> cq.Assembly:
    """Return the sensor of a result above its fruit [mm], before the press, as a CadQuery assembly.

    Parameters
    ----------
    result : SensorResult
        The result of `run` or `evaluate`.

    Returns
    -------
    cadquery.Assembly
        The parts of assembly.step: `housing` or `plate_1` and `plate_2`, `front_cover`, `screw_1`, `fruit` and others.
        The attribute `loc` of a part is its position, and equal parts share one shape. The faces of housing and covers
        are tagged.

    Raises
    ------
    InputError
        If the springs of the design cannot be made.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> assembly = twintip.assembly(result)
    >>> [part.name for part in assembly.children][:3]
    ['housing', 'front_cover', 'back_cover']
    """
    return assemble_sensor(_solids_of(result))


def _solids_of(result: SensorResult) -> SensorSolids:
    """Return the solids of the sensor of a result; raise InputError if the sensor has no housing."""
    housing_of_result = result.springs.housing
    if housing_of_result is None:
        hint = "see the verdicts printable.low and printable.high; a line of tips has no housing"
        raise validation_error("housing", result.design.name, "", "of a design whose springs can be made", hint)
    return draw_sensor(result.design, housing_of_result)

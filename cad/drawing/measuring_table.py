"""The measuring table: the dimensions that determine K or the contact, their tolerances, and the effects of errors.

K is the stiffness of a spring. The tolerance of a leaf is the accuracy of a thin wall in the print process. Most other
dimensions have the general tolerance. The effect of an error follows from closed forms:

- Each guided leaf of width w, thickness t and length L has the stiffness E w t^3 / L^3.
- The force is proportional to the travel.
- The contact stiffness of a flat face is proportional to its width; the contact stiffness of a sphere is proportional
  to the square root of its radius. See K. L. Johnson, Contact Mechanics, 1985, equations 3.35 and 4.23.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cad.drawing.canvas import DECIMALS, IN_TABLE, MEASURED, SMALL_MM, length_text
from cad.parts.housing import Arm, Housing
from cad.parts.layout import STOP_SAFETY
from cad.parts.part import NEAR_MM
from cad.parts.pin import GROUND_MM
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.theory.leaf_spring import Flexure, pair_stiffness

GENERAL_MM = 0.2  # general tolerance of a plastic print: the accuracy stated in the guides of print services
PIN_FIT = "h8"  # 0 to -14 um up to 3 mm, 0 to -18 um up to 6 mm (ISO 286-2); changes the contact by at most 1.4 %
STEP_MM = 0.1  # dimensional error for which the table shows the effect
HEADINGS = ("", "measure", "mm", "within", f"+{STEP_MM:g} moves")
_LETTERS = "abcdefghjkmnpqrstuvwxyz"  # without i, l and o, which look like digits
# The tolerances of ISO 2768-1 m [mm], by the largest length or radius [mm] to which they apply.
_LENGTHS_MM = {6.0: 0.1, 30.0: 0.2, 120.0: 0.3, 400.0: 0.5, 1000.0: 0.8}  # table 1
_RADII_MM = {3.0: 0.2, 6.0: 0.5, math.inf: 1.0}  # table 2


@dataclass(frozen=True, kw_only=True)
class MeasuredDimension:
    """A dimension to be measured [mm], which has one row in the table for each of its places.

    `letter` identifies the dimension on the drawing. `moves` describes the effect of an error of +0.1 mm.
    """

    places: tuple[str, ...]
    nominal: float
    tolerance: str
    moves: str = "-"
    letter: str = ""

    def label(self, text: str = MEASURED) -> str:
        """Return the text of the dimension on the drawing; `text` contains the placeholder for the measured length."""
        return f"{self.letter}{IN_TABLE} {text}"

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Return the rows of the table, each with one string for each of HEADINGS."""
        letters = [self.letter]
        if len(self.places) > 1:
            letters = [f"{self.letter}{number}" for number in range(1, len(self.places) + 1)]
        texts = (length_text(self.nominal), self.tolerance, self.moves)
        return [(letter, place, *texts) for letter, place in zip(letters, self.places, strict=True)]


def find_general_tolerance(process: Process, length: float, *, is_radius: bool = False) -> float:
    """Return the general tolerance of a length [+/- mm]; below 0.5 mm, it is the wall accuracy of the process.

    For a metal, the tolerance is from ISO 2768-1 m, where radii have a table of their own.
    """
    if length < SMALL_MM:
        return process.accuracy_mm
    if not process.is_metal:
        return GENERAL_MM
    tolerances = _RADII_MM if is_radius else _LENGTHS_MM
    # The ranges are in ascending order, so the first range that includes the length applies. A length beyond the last
    # range gets the largest tolerance.
    return next((tolerance for largest, tolerance in tolerances.items() if length <= largest), max(tolerances.values()))


def list_measured_dimensions(
    sensor: SensorSolids, process: Process, deflections: Sequence[float]
) -> Mapping[str, MeasuredDimension]:
    """Return the dimensions to be measured on a housing, keyed by name, which are the entries of the measuring table.

    `deflections` [mm] are the deflections of the low and the high spring at full travel, which the stops must allow.
    The dimensions are in the order of the table, and their letters are assigned in this order. The tolerance of a
    dimension is the accuracy of `process` or the general tolerance, except for pins.
    """
    housing = sensor.housing
    dimensions = {
        **_leaf_dimensions(housing, process),
        "fillet": MeasuredDimension(
            places=("radius, fillets of leaves",),
            nominal=housing.corner,
            tolerance=_plus_minus(find_general_tolerance(process, housing.corner, is_radius=True)),
        ),
        **_stop_dimensions(housing, process, deflections),
        **_tip_dimensions(sensor, process),
    }
    if sensor.seats is not None:
        dimensions["pocket"] = _single_dimension("diameter, magnet pockets", sensor.seats.pocket_diameter, process)
    if housing.back_to_back:
        dimensions["pad"] = _single_dimension("height, pad", housing.back_to_back.pad_height, process)
    # There are more letters than dimensions, so the last letters are not used.
    lettered_dimensions = zip(dimensions.items(), _LETTERS, strict=False)
    return {name: replace(dimension, letter=letter) for (name, dimension), letter in lettered_dimensions}


def _plus_minus(tolerance: float) -> str:
    """Return a symmetric tolerance [mm] as text."""
    return f"±{tolerance:g}"


def _single_dimension(place: str, nominal: float, process: Process, moves: str = "-") -> MeasuredDimension:
    """Return a dimension that is measured at one place and has the general tolerance.

    `nominal` [mm] is its nominal value, and `moves` is the text on the effect of an error of +0.1 mm.
    """
    return MeasuredDimension(
        places=(place,), nominal=nominal, tolerance=_plus_minus(find_general_tolerance(process, nominal)), moves=moves
    )


def _change_text(name: str, ratio: float) -> str:
    """Return the change of a quantity in per cent as text; `ratio` is the new value divided by the old value [1]."""
    return f"{name} {100.0 * (ratio - 1.0):+.2g} %"


def compute_stiffness_ratio(flexure: Flexure, *, thickness: float = 0.0, length: float = 0.0) -> float:
    """Return the new stiffness of a pair of leaves, divided by the old one [1], if both leaves change in size.

    `thickness` and `length` [mm] are the changes in thickness and length. The modulus cancels, so it is set to 1.
    """
    t, L, w = flexure.thickness, flexure.length, flexure.depth
    return pair_stiffness(1.0, w, t + thickness, L + length) / pair_stiffness(1.0, w, t, L)


def _leaf_dimensions(housing: Housing, process: Process) -> dict[str, MeasuredDimension]:
    """Return the dimensions of the leaves: the thickness and length for each spring, and the depth of the plate.

    In the table, the thicknesses of both springs come before their lengths.
    """
    depth_ratio = (housing.depth + STEP_MM) / housing.depth  # K is proportional to the depth
    return {
        **{f"{arm.name} thickness": _thickness_dimension(arm, process) for arm in housing.arms},
        **{f"{arm.name} length": _length_dimension(arm, process) for arm in housing.arms},
        "depth": _single_dimension("depth, leaves", housing.depth, process, _change_text("K", depth_ratio)),
    }


def _thickness_dimension(arm: Arm, process: Process) -> MeasuredDimension:
    """Return the leaf thickness of a spring, to be measured on both leaves.

    Each leaf contributes half of the stiffness, so an error of one leaf changes only half of it.
    """
    stiffness_ratio = 0.5 * (1.0 + compute_stiffness_ratio(arm.flexure, thickness=STEP_MM))
    return MeasuredDimension(
        places=tuple(f"thickness, {arm.name}: {leaf} leaf" for leaf in ("upper", "lower")),
        nominal=arm.flexure.thickness,
        tolerance=_plus_minus(process.accuracy_mm),
        moves=_change_text(_stiffness_symbol(arm), stiffness_ratio),
    )


def _length_dimension(arm: Arm, process: Process) -> MeasuredDimension:
    """Return the length that both leaves of a spring have."""
    return MeasuredDimension(
        places=(f"length, {arm.name} leaves",),
        nominal=arm.flexure.length,
        tolerance=_plus_minus(process.accuracy_mm),
        moves=_change_text(_stiffness_symbol(arm), compute_stiffness_ratio(arm.flexure, length=STEP_MM)),
    )


def _stiffness_symbol(arm: Arm) -> str:
    """Return the symbol of the stiffness of a spring: K_l for the low spring, K_h for the high one."""
    return f"K_{arm.name[0]}"


def _stop_dimensions(housing: Housing, process: Process, deflections: Sequence[float]) -> dict[str, MeasuredDimension]:
    """Return the gap above the shuttle of each spring, which is the distance to its stop.

    `deflections` [mm] are the deflections of the springs at full travel. A gap may not be smaller than the verdict
    geometry.stops_* allows. Its tolerance is the general one, or what the verdict leaves if this is less.
    """
    dimensions = {}
    for arm, deflection in zip(housing.arms, deflections, strict=True):
        gap = housing.cavity_level - arm.top_level
        # The gap may shrink by this length, which is rounded down to the decimals of the table.
        allowed = math.floor(10.0**DECIMALS * (gap - STOP_SAFETY * deflection) + NEAR_MM) / 10.0**DECIMALS
        tolerance = min(find_general_tolerance(process, gap), max(0.0, allowed))
        dimensions[f"{arm.name} stop"] = MeasuredDimension(
            places=(f"gap, {arm.name} stop",),
            nominal=gap,
            tolerance=_plus_minus(tolerance),
        )
    return dimensions


def _tip_dimensions(sensor: SensorSolids, process: Process) -> dict[str, MeasuredDimension]:
    """Return the dimensions of the tips, keyed by name: spacing, heights, height difference, and size of the contact.

    The size of the contact is the width of a flat tip, the width or diameter of a pin, or the radius of a dome.
    """
    housing = sensor.housing
    # A height error adds to the travel. Very soft springs deflect by the whole travel, and the force is proportional to
    # it. With very stiff springs, the fruit is indented by the whole travel, and the force of a dome is proportional to
    # travel^1.5 (Hertz). The larger exponent is used.
    exponent = 1.5 if housing.dome else 1.0
    force_change = _change_text("force", (1.0 + STEP_MM / sensor.press.travel_mm) ** exponent)
    height = housing.protrusion + housing.beyond_face
    accuracy = GROUND_MM if housing.pin else process.accuracy_mm
    return {
        "spacing": _single_dimension("tips, middle to middle", housing.spacing, process),
        "height": MeasuredDimension(
            places=tuple(f"{arm.name} tip, out of the frame" for arm in housing.arms),
            nominal=height,
            tolerance=_plus_minus(find_general_tolerance(process, height)),
            moves=force_change,
        ),
        # The letter of the heights is k, and their rows are k1 for the low tip and k2 for the high tip.
        "level": MeasuredDimension(
            places=("high less low: k2 - k1",), nominal=0.0, tolerance=_plus_minus(accuracy), moves=force_change
        ),
        "tip": _contact_dimension(sensor, process),
    }


def _contact_dimension(sensor: SensorSolids, process: Process) -> MeasuredDimension:
    """Return the dimension of a tip that determines the contact: a dome radius, a pin size, or a face width.

    The contact stiffness is proportional to the width of a flat face, and to the square root of the radius of a dome.
    """
    housing = sensor.housing
    names = [arm.name for arm in housing.arms]
    if housing.dome:
        return _dome_dimension(housing.dome.radius, names, process)
    side = housing.touching_side
    if housing.pin:
        part = "pin"
        size = "diameter" if housing.pin.is_round else "width"
        tolerance = PIN_FIT
    else:
        part = "tip"
        size = "width"
        tolerance = _plus_minus(find_general_tolerance(process, side))
    # The width determines the contact only if the end is flat and has sharp edges.
    is_flat = sensor.tips.tip_shape.is_flat
    contact_change = _change_text("contact", (side + STEP_MM) / side) if is_flat else "-"
    return MeasuredDimension(
        places=tuple(f"{size}, {name} {part}" for name in names),
        nominal=side,
        tolerance=tolerance,
        moves=contact_change,
    )


def _dome_dimension(radius: float, names: Sequence[str], process: Process) -> MeasuredDimension:
    """Return the radius of the domes [mm] as a dimension to be measured; `names` are the names of the tips."""
    return MeasuredDimension(
        places=tuple(f"radius SR, {name} dome" for name in names),
        nominal=radius,
        tolerance=_plus_minus(find_general_tolerance(process, radius, is_radius=True)),
        moves=_change_text("contact", math.sqrt((radius + STEP_MM) / radius)),
    )

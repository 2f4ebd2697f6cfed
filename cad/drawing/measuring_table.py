"""The table of the dimensions that decide K or the contact: what to measure, nominal, tolerance, what each moves.

A tolerance is the accuracy of a thin wall by the process, where the process gives it, else the general tolerance.
What a dimension moves is a closed form. Two guided leaves have E w t^3 / L^3 each, and the force is proportional to the
travel. The contact of a flat face follows its width, that of a ball the root of its radius. See K. L. Johnson, Contact
Mechanics, 1985, 3.35 and 4.23.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from cad.drawing.canvas import IN_TABLE, MEASURED, SMALL_MM, length_text
from cad.parts.housing import Housing
from cad.parts.pin import GROUND_MM
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.theory.leaf_spring import Flexure, pair_stiffness

GENERAL_MM = 0.2  # what no dimension says otherwise: the accuracy of a printed part in print-service guides
PIN_FIT = "h8"  # 0 to -14 um up to 3 mm, -18 um up to 6 mm, ISO 286-2: contact is proportional to the width, to 1.4 %
STEP_MM = 0.1  # for which the table says what it moves
HEADS = ("", "measure", "mm", "within", f"+{STEP_MM:g} moves")
_LETTERS = "abcdefghjkmnpqrstuvwxyz"  # without those that look like a digit
_LENGTHS_MM = {6.0: 0.1, 30.0: 0.2, 120.0: 0.3, 400.0: 0.5, 1000.0: 0.8}  # ISO 2768-1 m, table 1, up to a length
_RADII_MM = {3.0: 0.2, 6.0: 0.5, math.inf: 1.0}  # ISO 2768-1 m, table 2


@dataclass(frozen=True, kw_only=True)
class MeasuredDimension:
    """A dimension to be measured [mm]: its letter on the drawing, and the places where it is, each a row.

    `moves` says what 0.1 mm more of it moves.
    """

    places: tuple[str, ...]
    nominal: float
    tolerance: str
    moves: str = "-"
    letter: str = ""

    def label(self, text: str = MEASURED) -> str:
        """Return the text of its dimension on the drawing."""
        return f"{self.letter}{IN_TABLE} {text}"

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Return the dimension's rows of the table as texts, one for each of HEADS."""
        letters = [self.letter]
        if len(self.places) > 1:
            letters = [f"{self.letter}{number}" for number in range(1, len(self.places) + 1)]
        texts = (length_text(self.nominal), self.tolerance, self.moves)
        return [(letter, place, *texts) for letter, place in zip(letters, self.places, strict=True)]


def general_mm(process: Process, length: float, *, is_radius: bool = False) -> float:
    """Return the general tolerance of a length [mm], plus or minus; under 0.5 mm it is the process's of a thin wall."""
    if length < SMALL_MM:
        return process.accuracy_mm
    if not process.is_metal:
        return GENERAL_MM
    classes = _RADII_MM if is_radius else _LENGTHS_MM
    return next((within for most, within in classes.items() if length <= most), max(classes.values()))


def measuring_table(sensor: SensorSolids, process: Process) -> Mapping[str, MeasuredDimension]:
    """Return the characteristics of a housing by name, in the order of the table, with letters."""
    housing = sensor.housing
    found = {
        **_leaves(housing, process),
        "fillet": MeasuredDimension(
            places=("radius, fillets of leaves",),
            nominal=housing.corner,
            tolerance=_within(general_mm(process, housing.corner, is_radius=True)),
        ),
        **_stops(housing, process),
        **_tips(sensor, process),
    }
    if sensor.seats is not None:
        found["pocket"] = _plain("diameter, magnet pockets", sensor.seats.pocket_diameter, process)
    if housing.back_to_back:
        found["pad"] = _plain("height, pad", housing.back_to_back.pad_height, process)
    return {name: replace(one, letter=letter) for (name, one), letter in zip(found.items(), _LETTERS, strict=False)}


def _within(tolerance: float) -> str:
    return f"±{tolerance:g}"


def _plain(place: str, nominal: float, process: Process, moves: str = "-") -> MeasuredDimension:
    """Return a characteristic of the general tolerance."""
    return MeasuredDimension(
        places=(place,), nominal=nominal, tolerance=_within(general_mm(process, nominal)), moves=moves
    )


def _percent(name: str, ratio: float) -> str:
    """Return the relative change of a quantity as text, from its ratio [1]."""
    return f"{name} {100.0 * (ratio - 1.0):+.2g} %"


def stiffness_gain(flexure: Flexure, *, thickness: float = 0.0, length: float = 0.0) -> float:
    """Return the stiffness ratio [1] of a pair of leaves after a change of thickness or length [mm]."""
    t, L, w = flexure.thickness, flexure.length, flexure.depth
    return pair_stiffness(1.0, w, t + thickness, L + length) / pair_stiffness(1.0, w, t, L)


def _leaves(housing: Housing, process: Process) -> dict[str, MeasuredDimension]:
    """Return thickness and length of the leaves by spring, and the depth of the plate.

    A thickness is measured at each of the two leaves of a spring, which carry half of its stiffness each.
    """
    found = {}
    within = _within(process.accuracy_mm)
    for arm in housing.arms:
        flexure = arm.flexure
        one_of_two = 0.5 * (1.0 + stiffness_gain(flexure, thickness=STEP_MM))  # the other leaf is as it was
        found[f"{arm.name} thickness"] = MeasuredDimension(
            places=tuple(f"thickness, {arm.name}: {leaf} leaf" for leaf in ("upper", "lower")),
            nominal=flexure.thickness,
            tolerance=within,
            moves=_percent(f"K_{arm.name[0]}", one_of_two),
        )
    for arm in housing.arms:
        found[f"{arm.name} length"] = MeasuredDimension(
            places=(f"length, {arm.name} leaves",),
            nominal=arm.flexure.length,
            tolerance=within,
            moves=_percent(f"K_{arm.name[0]}", stiffness_gain(arm.flexure, length=STEP_MM)),
        )
    deeper = (housing.depth + STEP_MM) / housing.depth
    return {**found, "depth": _plain("depth, leaves", housing.depth, process, _percent("K", deeper))}


def _stops(housing: Housing, process: Process) -> dict[str, MeasuredDimension]:
    """Return the gaps over the shuttles."""
    return {
        f"{arm.name} stop": _plain(f"gap, {arm.name} stop", housing.cavity_level - arm.top_level, process)
        for arm in housing.arms
    }


def _tips(sensor: SensorSolids, process: Process) -> dict[str, MeasuredDimension]:
    """Return spacing, heights and widths of the tips; radii where they are domes."""
    housing = sensor.housing
    # Between springs that take all of the travel, where force ~ travel, and none of it, where Hertz's law holds
    # for a dome: the larger counts.
    power = 1.5 if housing.dome else 1.0
    longer = _percent("force", (1.0 + STEP_MM / sensor.press.travel_mm) ** power)
    height = housing.protrusion + housing.beyond_face
    accuracy = GROUND_MM if housing.pin else process.accuracy_mm
    return {
        "spacing": _plain("tips, middle to middle", housing.spacing, process),
        "height": MeasuredDimension(
            places=tuple(f"{arm.name} tip, out of the frame" for arm in housing.arms),
            nominal=height,
            tolerance=_within(general_mm(process, height)),
            moves=longer,
        ),
        "level": MeasuredDimension(
            places=("high less low: k2 - k1",), nominal=0.0, tolerance=_within(accuracy), moves=longer
        ),
        "tip": _tip(sensor, process),
    }


def _tip(sensor: SensorSolids, process: Process) -> MeasuredDimension:
    """Return the characteristic of a tip: the radius of a dome, else the width of a face or of a pin."""
    housing = sensor.housing
    names = [arm.name for arm in housing.arms]
    if housing.dome:
        radius = housing.dome.radius
        return MeasuredDimension(
            places=tuple(f"radius SR, {name} dome" for name in names),
            nominal=radius,
            tolerance=_within(general_mm(process, radius, is_radius=True)),
            moves=_percent("contact", math.sqrt((radius + STEP_MM) / radius)),
        )
    side = housing.touching_side
    is_flat = sensor.tips.tip_shape.is_flat
    size = "diameter" if housing.pin and housing.pin.is_round else "width"
    kind = "pin" if housing.pin else "tip"
    return MeasuredDimension(
        places=tuple(f"{size}, {name} {kind}" for name in names),
        nominal=side,
        tolerance=PIN_FIT if housing.pin else _within(general_mm(process, side)),
        moves=_percent("contact", (side + STEP_MM) / side) if is_flat else "-",
    )

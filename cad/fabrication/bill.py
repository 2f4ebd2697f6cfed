"""The bill of materials: what is printed, bought and wired, with counts, sizes and standards."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields

from cad.fabrication.bridges import HX711, RESISTANCE_OHM, SignalPath, Spring, series_resistor
from cad.fabrication.mount import FLANGE_SCREW_MM, mounted_grip
from cad.fabrication.templates import EACH, render_template
from cad.parts.assembly import dowel_length, grip, screw_length
from cad.parts.housing import DOWEL_MM, Housing
from cad.parts.sensor import SensorSolids
from cad.parts.strips import CutStrip, cut_strips, glue_volume, length_of_stock
from sensor.design.processes import Process
from sensor.design.readout import PROBE
from sensor.theory.strain_gauge import FOIL

_ROUND_MM = 10.0  # to which lengths of sheet are rounded up


@dataclass(frozen=True)
class BillLine:
    """One line of the bill: how many of what, its size, its standard or file, and what it is for."""

    count: int
    part: str
    size: str
    standard: str
    note: str


def bill_of_materials(
    sensor: SensorSolids,
    process: Process,
    springs: Sequence[Spring],
    masses: Mapping[str, float],
    signal: SignalPath | None = None,
) -> tuple[BillLine, ...]:
    """Return every line of the bill; `masses` are those of the printed parts by name [g].

    With a signal path glue, wire and board are there too.
    """
    housing = sensor.housing
    text = render_template(
        "bill.csv.jinja",
        process=process,
        housing=housing,
        masses=masses,
        each=EACH,
        springs=springs,
        tips=len(sensor.tips.springs),
        holes=len(housing.holes),
        screw=screw_name(mounted_grip(sensor)),
        bare_screw=screw_name(grip(sensor)),
        flange_screw_mm=FLANGE_SCREW_MM,
        dowel_diameter=DOWEL_MM,
        dowel_mm=dowel_length(housing) or housing.stack,
        gauge=FOIL,
        ohms=RESISTANCE_OHM,
        amplifier=HX711,
        resistor=series_resistor(process),
        signal=signal,
        probe=PROBE,
        sheet=sensor.sheet,
        sheets=sheets_to_buy(sensor),
        strips=cut_strips(housing),
        glue_ml=glue_ml(housing),
    )
    return tuple(BillLine(int(count), *texts) for count, *texts in csv.reader(text.splitlines()))


@dataclass(frozen=True, kw_only=True)
class SheetToBuy:
    """A piece of sheet for strips of one thickness: thickness, width and least length [mm], and the springs.

    Where even the widest piece that is sold is narrower than the strips, the width is that piece's and the length None.
    """

    thickness: float
    width: float
    length: float | None
    springs: tuple[str, ...]


def sheets_to_buy(sensor: SensorSolids) -> tuple[SheetToBuy, ...]:
    """Return the pieces of sheet of a sensor, one for each thickness as it is sold; none where leaves are printed."""
    sheet = sensor.sheet
    if sheet is None:
        return ()
    of_thickness: dict[float, list[CutStrip]] = {}
    for strips in cut_strips(sensor.housing):
        of_thickness.setdefault(sheet.sold_as(strips.thickness), []).append(strips)
    found = []
    for thickness, kinds in of_thickness.items():
        enough = [
            width for width, length in sheet.stock if sum(length_of_stock(each, width) for each in kinds) <= length
        ]
        width = min(enough, default=max(sheet.stock_widths_mm))
        lengths = [length_of_stock(each, width) for each in kinds]
        is_wide_enough = math.isfinite(sum(lengths))
        length = sum(math.ceil(each / _ROUND_MM) * _ROUND_MM for each in lengths) if is_wide_enough else None
        springs = tuple(each.spring for each in kinds)
        found.append(SheetToBuy(thickness=thickness, width=width, length=length, springs=springs))
    return tuple(found)


def glue_ml(housing: Housing) -> float:
    """Return the volume of glue to be mixed for the strips of a sensor [ml]: what slots hold, and as much again."""
    return math.ceil(10.0 * 2.0 * 1e-3 * glue_volume(housing)) / 10.0


def screw_name(grip_mm: float) -> str:
    """Return the screw that holds a grip [mm]."""
    length = screw_length(grip_mm)
    return "M3 threaded rod, cut" if length is None else f"M3 x {length}"


def bill_csv(rows: Sequence[BillLine]) -> str:
    """Return the bill as CSV with a head line."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.name for field in fields(BillLine)])
    writer.writerows(astuple(row) for row in rows)
    return text.getvalue()

"""The bill of materials: printed parts, bought parts and wiring, with their counts, sizes and standards."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields

import cadquery as cq

from cad.fabrication.mount import FLANGE_SCREW_MM, mounted_grip
from cad.fabrication.sheet_templates import EACH, render_template
from cad.fabrication.wiring import count_wires
from cad.parts.assembly import dowel_length, grip, part_type, screw_length
from cad.parts.housing import DOWEL_MM
from cad.parts.sensor import SensorSolids
from sensor.design.processes import Process
from sensor.design.readout import PROBE
from sensor.design.signal_path import SignalPath


@dataclass(frozen=True)
class BillLine:
    """One line of the bill: count, kind of part, size, standard or file, and purpose."""

    count: int
    part: str
    size: str
    standard: str
    note: str


def bill_of_materials(
    sensor: SensorSolids,
    assembly: cq.Assembly,
    process: Process,
    masses: Mapping[str, float],
    signal: SignalPath | None = None,
) -> tuple[BillLine, ...]:
    """Return every line of the bill, with the parts counted in the assembly of the sensor.

    The template `bill.csv.jinja` writes the lines as CSV text, from the values below. `assembly` is the assembly
    without the bracket, and `process` is the print process. `masses` holds the masses of the printed parts [g], keyed
    by part name. If there is a signal path, the bill also lists the electronic parts, wire and glue.
    """
    housing = sensor.housing
    csv_text = render_template(
        "bill.csv.jinja",
        process=process,
        housing=housing,
        masses=masses,
        each=EACH,
        count=Counter(map(part_type, assembly.children)),  # number of parts of each type, for example `washer`
        tips=len(sensor.tips.springs),  # each tip has one spring
        screw=screw_name(mounted_grip(sensor)),
        screw_without_bracket=screw_name(grip(sensor)),
        flange_screw_mm=FLANGE_SCREW_MM,
        dowel_diameter=DOWEL_MM,
        dowel_mm=dowel_length(housing) or housing.stack,  # if no standard dowel fits, one is cut to length
        signal=signal,
        wires=0 if signal is None else count_wires(len(sensor.tips.springs), signal.board),
        probe=PROBE,
    )
    # The first column is the count. The other columns are the text fields of a line, in their order.
    return tuple(BillLine(int(count), *texts) for count, *texts in csv.reader(csv_text.splitlines()))


def screw_name(grip_mm: float) -> str:
    """Return the name of the shortest standard screw for a grip [mm], or of a threaded rod if all are too short."""
    length = screw_length(grip_mm)
    return "M3 threaded rod, cut" if length is None else f"M3 x {length}"


def bill_csv(rows: Sequence[BillLine]) -> str:
    """Return the bill as CSV text with a header line."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.name for field in fields(BillLine)])
    writer.writerows(astuple(row) for row in rows)
    return text.getvalue()

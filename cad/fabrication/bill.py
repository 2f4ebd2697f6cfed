"""The bill of materials: what is printed, bought and wired, with counts, sizes and standards."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, fields

from cad.design.processes import Process
from cad.fabrication.bridges import AMPLIFIER, RESISTANCE_OHM, Bridge, series_resistor
from cad.fabrication.mount import FLANGE_SCREW_MM, mounted_grip
from cad.parts.assembly import dowel_length, grip, screw_length
from cad.parts.housing import DOWEL_MM
from cad.parts.sensor import Sensor
from cad.theory.strain_gauge import FOIL


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the bill: how many of what, its size, its standard or file, and what it is for."""

    count: int
    part: str
    size: str
    standard: str
    note: str


def bill_of_materials(
    sensor: Sensor, process: Process, bridges: Sequence[Bridge], masses: dict[str, float]
) -> tuple[Row, ...]:
    """Return every line of the bill; `masses` are those of the printed parts by name [g]."""
    return (
        *_made(sensor, process, masses),
        *_fasteners(sensor),
        *_inserts(sensor),
        *_electronics(sensor, process, bridges),
    )


def _made(sensor: Sensor, process: Process, masses: dict[str, float]) -> Iterator[Row]:
    """Yield what is made by the process, with its mass [g]."""
    square, covered = sensor.housing.back_to_back, sensor.housing.mount == "covers"
    counts = {"housing": 2 if square else 1, "cover": 2 if covered else 0, "coupon": 1, "mount": 1}
    uses = {
        "housing": "plate of the square" if square else "the springs",
        "cover": "front and back",
        "coupon": "test piece, to measure the modulus",
        "mount": "bracket to the flange of a robot or to a handle; also in aluminium",
    }
    for name, count in counts.items():
        if count:
            size = f"{masses[name]:.1f} g each"
            yield Row(count=count, part=name, size=size, standard=f"{name}.stl, {process.material}", note=uses[name])


def _fasteners(sensor: Sensor) -> Iterator[Row]:
    """Yield screws, nuts and washers."""
    count = len(sensor.housing.holes)
    length, bare = (screw_name(grip_mm) for grip_mm in (mounted_grip(sensor), grip(sensor)))
    covers = sensor.housing.mount == "covers"
    covered = ", covers" if covers else ""
    washers, between = (2, "") if covers else (3, ", and between frame and bracket")
    through = f"housing{covered} and bracket; {bare} without the bracket"
    flange = f"M6 x {FLANGE_SCREW_MM:g}"
    yield Row(count=count, part="screw", size=length, standard="ISO 4762", note=f"through {through}")
    yield Row(count=count, part="nut", size="M3", standard="ISO 4032", note="one on each screw")
    where = f"under each head and each nut{between}"
    yield Row(count=washers * count, part="washer", size="M3", standard="ISO 7089", note=where)
    yield Row(count=4, part="screw", size=flange, standard="ISO 4762", note="bracket to the flange")


def screw_name(grip_mm: float) -> str:
    """Return the screw that holds a grip [mm]."""
    length = screw_length(grip_mm)
    return "M3 threaded rod, cut" if length is None else f"M3 x {length}"


def _inserts(sensor: Sensor) -> Iterator[Row]:
    """Yield dowels between the plates of a square, and pins that are tips."""
    housing, tips = sensor.housing, len(sensor.tips.springs)
    if housing.dowels:
        size = f"{DOWEL_MM:g} x {dowel_length(housing) or housing.stack:g}"
        yield Row(count=2, part="dowel", size=size, standard="ISO 8734", note="between the plates")
    if housing.pin_side:
        size = f"{housing.pin_side:g} x {housing.pin_out + housing.pocket_depth:g} mm"
        yield Row(count=tips, part="pin", size=size, standard="pin.step, ground steel", note="a tip, glued in")


def _electronics(sensor: Sensor, process: Process, bridges: Sequence[Bridge]) -> Iterator[Row]:
    """Yield gauges, amplifiers and resistors, where gauges are chosen."""
    if sensor.housing.gauges == "none":
        return
    count = len(sensor.tips.springs)
    grid, ohms = f"{FOIL.grid_length_mm:g} x {FOIL.grid_width_mm:g} mm", f"{RESISTANCE_OHM:g} ohm"
    outputs = ", ".join(f"{one.name} {one.output:.3g} mV/V per N" for one in bridges if one.output is not None)
    yield Row(
        count=4 * count,
        part="strain gauge",
        size=f"grid {grid}, {ohms}, gauge factor {FOIL.gauge_factor:g}",
        standard="foil on polyimide",
        note=f"four are the full bridge of a spring: {outputs}",
    )
    note = f"gain {AMPLIFIER['gain']:g}, +-{AMPLIFIER['full_scale_mV']:g} mV, one for each bridge"
    yield Row(count=count, part="amplifier", size=f"{AMPLIFIER['supply_V']:g} V", standard=AMPLIFIER["name"], note=note)
    size = f"{series_resistor(process):.0f} ohm, 0.1 %"
    yield Row(
        count=2 * count, part="resistor", size=size, standard="metal film", note="in both supply wires of a bridge"
    )


def bill_csv(rows: Sequence[Row]) -> str:
    """Return the bill as CSV with a head line."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([item.name for item in fields(Row)])
    writer.writerows(astuple(row) for row in rows)
    return text.getvalue()


def bill_table(rows: Sequence[Row]) -> str:
    """Return the bill as a table of Markdown."""
    heads = [item.name for item in fields(Row)]
    lines = [heads, ["---"] * len(heads), *([str(cell) for cell in astuple(row)] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)

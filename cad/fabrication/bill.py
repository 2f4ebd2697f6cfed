"""The bill of materials: what is printed, bought and wired, with counts, sizes and standards."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields

from cad.design.processes import Process
from cad.fabrication.bill_words import EACH
from cad.fabrication.bridges import HX711, RESISTANCE_OHM, SignalPath, Spring, series_resistor
from cad.fabrication.mount import FLANGE_SCREW_MM, mounted_grip
from cad.parts.assembly import dowel_length, grip, screw_length
from cad.parts.housing import DOWEL_MM
from cad.parts.sensor import Sensor
from cad.theory.strain_gauge import FOIL


@dataclass(frozen=True)
class Row:
    """One line of the bill: how many of what, its size, its standard or file, and what it is for."""

    count: int
    part: str
    size: str
    standard: str
    note: str


def bill_of_materials(
    sensor: Sensor,
    process: Process,
    springs: Sequence[Spring],
    masses: Mapping[str, float],
    signal: SignalPath | None = None,
) -> tuple[Row, ...]:
    """Return every line of the bill; `masses` are those of the printed parts by name [g].

    With a signal path glue, wire and board are there too.
    """
    rows = [*_printed(sensor, process, masses), *_bought(sensor)]
    if signal is not None and signal.transducer == "displacement":
        rows += _probes(len(sensor.tips.springs))
    else:
        rows += _electronics(sensor, process, springs)
    return (*rows, *(() if signal is None else _board(signal)))


def _probes(count: int) -> list[Row]:
    """Return the sensors of displacement, their magnets and their amplifiers."""
    return [
        Row(count, "Hall sensor", "TO-92, 30 mV/mT at 3.3 V", "DRV5055A2", "one at each shuttle, in the cover"),
        Row(2 * count, "magnet", "disc 2 x 1 mm, N42", "NdFeB", "two opposite ones, 3 mm apart, on each shuttle"),
        Row(-(-count // 4), "amplifier", "24 bit, four inputs", "ADS1220", "supply as reference, gain 1"),
        Row(count + 1, "capacitor", "100 nF", "ceramic X7R", "at the supply of each Hall sensor and of the amplifier"),
    ]


def _board(signal: SignalPath) -> list[Row]:
    """Return what every read-out needs beside transducers and amplifiers."""
    glue = "2 g"
    kind = "cyanoacrylate for strain gauges" if signal.transducer == "foil" else "two-part epoxy"
    bonded = "gauges on the leaves" if signal.transducer == "foil" else "magnets in the shuttles, sensors in the covers"
    wires = 4 * len(signal.counts_per_N) if signal.transducer == "foil" else 3 * len(signal.counts_per_N)
    return [
        Row(1, "glue", glue, kind, bonded),
        Row(
            wires, "wire", "0.3 m, 0.05 mm2", "stranded, as thin as it is sold", "wiring.svg; loose, so that none pulls"
        ),
        Row(1, "board", "3.3 V, with USB", signal.board.upper(), "pins as in wiring.svg; MicroPython"),
    ]


def _printed(sensor: Sensor, process: Process, masses: Mapping[str, float]) -> list[Row]:
    """Return what is made by the process, with its mass [g]."""
    housing = sensor.housing
    parts = [(1, "coupon", "test piece, to measure the modulus")]
    if housing.mount == "covers":
        parts.insert(0, (2, "cover", "front and back"))
    parts.insert(0, (2, "housing", "plate of the square") if housing.back_to_back else (1, "housing", "the springs"))
    parts.append((1, "mount", "bracket to the flange of a robot or to a handle; also in aluminium"))
    return [
        Row(count, name, f"{masses[name]:.1f} g{EACH}", f"{name}.stl, {process.material}", note)
        for count, name, note in parts
    ]


def _bought(sensor: Sensor) -> list[Row]:
    """Return screws, nuts, washers, dowels between the plates of a square, and pins that are tips."""
    housing = sensor.housing
    holes = len(housing.holes)
    has_covers = housing.mount == "covers"
    held = "housing, covers and bracket" if has_covers else "housing and bracket"
    through = f"through {held}; {screw_name(grip(sensor))} without the bracket"
    washers = 2 * holes if has_covers else 3 * holes
    between = "" if has_covers else ", and between frame and bracket"
    rows = [
        Row(holes, "screw", screw_name(mounted_grip(sensor)), "ISO 4762", through),
        Row(holes, "nut", "M3", "ISO 4032", "one on each screw"),
        Row(washers, "washer", "M3", "ISO 7089", f"under each head and each nut{between}"),
        Row(4, "screw", f"M6 x {FLANGE_SCREW_MM:g}", "ISO 4762", "bracket to the flange"),
    ]
    if housing.dowels:
        size = f"{DOWEL_MM:g} x {dowel_length(housing) or housing.stack:g}"
        rows.append(Row(2, "dowel", size, "ISO 8734", "between the plates"))
    if housing.pin_side:
        size = f"{housing.pin_side:g} x {housing.pin_out + housing.pocket_depth:g} mm"
        rows.append(Row(len(sensor.tips.springs), "pin", size, "pin.step, ground steel", "a tip, glued in"))
    return rows


def screw_name(grip_mm: float) -> str:
    """Return the screw that holds a grip [mm]."""
    length = screw_length(grip_mm)
    return "M3 threaded rod, cut" if length is None else f"M3 x {length}"


def _electronics(sensor: Sensor, process: Process, springs: Sequence[Spring]) -> list[Row]:
    """Return gauges, amplifiers and resistors, where gauges are chosen."""
    if sensor.housing.gauges == "none":
        return []
    count = len(sensor.tips.springs)
    grid = f"grid {FOIL.grid_length_mm:g} x {FOIL.grid_width_mm:g} mm"
    gauge = f"{grid}, {RESISTANCE_OHM:g} ohm, gauge factor {FOIL.gauge_factor:g}"
    outputs = ", ".join(f"{spring.name} {spring.bridge_output:.3g} mV/V per N" for spring in springs)
    gain = f"gain 128, +-{HX711.full_scale_mV:g} mV, one for each bridge"
    resistor = f"{series_resistor(process):g} ohm, 0.1 %"
    return [
        Row(4 * count, "strain gauge", gauge, "foil on polyimide", f"four are the full bridge of a spring: {outputs}"),
        Row(count, "amplifier", f"{HX711.supply_V:g} V", HX711.name, gain),
        Row(2 * count, "resistor", resistor, "metal film", "in both supply wires of a bridge"),
    ]


def bill_csv(rows: Sequence[Row]) -> str:
    """Return the bill as CSV with a head line."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.name for field in fields(Row)])
    writer.writerows(astuple(row) for row in rows)
    return text.getvalue()

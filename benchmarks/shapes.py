"""Moduli read from presses and from single moments on fruits of other shapes, and their sensitivity: tables of docs.

Forces are from boundary elements, which share no code with the product (`reference/ellipsoid_presses.py`). A unit with
exact springs reads them. Its error bars include a standard uncertainty of 1 % for springs, and of 0.1 % for channels
besides their drift.
"""

import argparse
import io
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from benchmarks.cheeks import sensor_of
from benchmarks.plot import STYLE
from reference.ellipsoid_presses import Fruit, press
from sensor.theory.contrast_law import ReadingError, read_modulus
from tests.measured_units import MeasuredDesign, read_press

MODULI = (0.5, 1.0, 3.5)
SAMPLES = 24
SHAPES = ((35, 35, 0), (45, 65, 0), (45, 65, 22.5), (45, 65, 45), (45, 65, -45), (42, 100, 45), (53, 144, 45))
CHEEK = Fruit(E=1.0, R1=47.0, R2=110.0, azimuth=30.0, tilt=2.0, tilt_azimuth=70.0)
TILT_CHANGE, HEIGHT, OUTWARD, ZERO = np.radians(0.5), 0.05, 0.1, 0.005  # [rad], [mm], [mm], of the full scale [1]


class Reader:
    """A unit of a design, the sensor that presses, and the travels of its samples."""

    def __init__(self, name):
        """Make a unit with a standard uncertainty of 1 % of its springs, and of 0.1 % beside drift of its channels."""
        self.measured = MeasuredDesign(name)
        signal = self.measured.report.read_out.signal
        drift = 0.0 if signal is None else max(signal.gain_drift_percent) / np.sqrt(3.0)
        unit = self.measured.measuring(percent=1.0, gain_percent=float(np.hypot(0.1, drift)))
        self.unit = replace(unit, unit=replace(unit.unit, calibrated_by="plate"))
        self.sensor = sensor_of(self.measured.design, self.measured.K)
        self.travels = np.linspace(0.0, self.measured.design.press.travel_mm, SAMPLES + 1)[1:]
        self.full_scale = np.array(self.measured.report.read_out.full_scale_N)

    def press(self, forces):
        """Return the reading of a whole press (samples, tips) [N]."""
        return read_press(self.unit, forces)

    def moment(self, forces):
        """Return the modulus that the last sample would tell by itself [MPa], None where it tells none."""
        try:
            return read_modulus(self.unit.law, forces[-1].tolist())
        except ReadingError:
            return None


def shown(reading, E):
    """Return the error and the bar of a reading in words [%]."""
    if reading.E is None:
        return "none: " + " ".join(reading.flags)
    flags = " ".join(reading.flags)
    return f"{100.0 * (reading.E / E - 1.0):+.1f} ± {100.0 * reading.u:.0f} {flags}".strip()


def shapes(reader):
    """Print the first table: fruits of other shapes."""
    print("| R1, R2, azimuth | E | press [%] | one moment [%] |\n|---|---|---|---|")
    for R1, R2, azimuth in SHAPES:
        for E in MODULI:
            forces = press(reader.sensor, Fruit(E=E, R1=R1, R2=R2, azimuth=azimuth), reader.travels)
            moment = reader.moment(forces)
            by_press = shown(reader.press(forces), E)
            by_moment = "none" if moment is None else f"{100.0 * (moment / E - 1.0):+.1f}"
            print(f"| {R1}, {R2} mm, {azimuth:g} deg | {E:g} | {by_press} | {by_moment} |", flush=True)


def changed(reader, E):
    """Yield what changes on a cheek, and the forces of a press with it (samples, tips) [N]."""
    fruit = replace(CHEEK, E=E)
    plain = press(reader.sensor, fruit, reader.travels)
    yield "nothing", plain
    yield "tilt changes by 0.5 deg", press(reader.sensor, fruit, reader.travels, drift=(TILT_CHANGE, 0.0))
    each_tip = np.eye(len(reader.measured.K))  # a row of it picks one tip: 0 is a low one, 1 a high one
    high = HEIGHT * (reader.measured.K.mean() < reader.measured.K)
    yield "high tips 0.05 mm longer", press(reader.sensor, replace(fruit, heights=tuple(high)), reader.travels)
    one = tuple(HEIGHT * each_tip[1])
    yield "one high tip 0.05 mm longer", press(reader.sensor, replace(fruit, heights=one), reader.travels)
    beside = reader.sensor.positions + OUTWARD * each_tip[1][:, None] * np.array([0.7071, 0.7071])
    yield "one high tip 0.1 mm outward", press(replace(reader.sensor, positions=beside), fruit, reader.travels)
    for tip, name in ((0, "low"), (1, "high")):
        yield f"zero of a {name} tip 0.5 % of full scale off", plain + ZERO * reader.full_scale * each_tip[tip]


def changes(reader):
    """Print the second table: what moves a press, and a single moment."""
    print("| change | E | press moves by [%] | single moment moves by [%] |\n|---|---|---|---|")
    for E in MODULI:
        unchanged = None  # the moduli by press and by moment where nothing changes, the first row
        for name, forces in changed(reader, E):
            found = reader.press(forces).E, reader.moment(forces)
            cells = []
            if unchanged is None:
                unchanged = found
                for modulus in found:
                    cells.append(f"(off by {100.0 * (modulus / E - 1.0):+.1f})" if modulus else "none")
            else:
                for modulus, before in zip(found, unchanged, strict=True):
                    cells.append(f"{100.0 * (modulus / before - 1.0):+.2f}" if modulus and before else "none")
            print(f"| {name} | {E:g} |", " | ".join(cells), "|", flush=True)


CURVES = (
    ("ball, 1 MPa", Fruit(E=1.0, R1=65.0, R2=65.0), "-", "tab:blue"),
    ("saddle, 1 MPa", Fruit(E=1.0, R1=47.0, R2=110.0, azimuth=45.0), "--", "tab:blue"),
    ("ball, 3.2 MPa", Fruit(E=3.2, R1=65.0, R2=65.0), "-", "tab:red"),
)


def picture(reader):
    """Return the contrast of deflections over the force as SVG, where the saddle looks like firmer flesh."""
    weights = np.array(reader.measured.report.read_out.weights)
    drawing = io.StringIO()
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 3.4), layout="constrained")
        axes = figure.add_subplot()
        axes.set(xlabel="force of all tips [N]", ylabel="deflection of low springs\nless that of high ones [mm]")
        for label, fruit, line, colour in CURVES:
            forces = press(reader.sensor, fruit, reader.travels)
            forces = forces[(forces > 0.0).all(axis=1)]
            contrast = -(forces @ (weights / reader.measured.K))
            axes.plot(forces.sum(axis=1), contrast, line, color=colour, label=label)
        axes.grid(visible=True, color="#dddddd")
        axes.legend(frameon=False)
        figure.savefig(drawing, format="svg", metadata={"Date": None})
    return drawing.getvalue()


def main() -> int:
    """Print both tables, or draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("design", nargs="?", default="mango")
    parser.add_argument("--picture", type=Path, help="write the picture there instead")
    asked = parser.parse_args()
    reader = Reader(asked.design)
    if asked.picture is not None:
        asked.picture.write_text(picture(reader), encoding="utf-8")
        return 0
    shapes(reader)
    changes(reader)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Settings of a print as its G-code shows them: what PrusaSlicer writes at its end is those of the profile."""

import math
import re
import subprocess

import numpy as np
from deadline import DEADLINE_S

FILAMENT_MM = 1.75  # as PrusaSlicer has it where nothing is set
_TOLD = re.compile(r";(TYPE|WIDTH|HEIGHT):(.*)")
_NUMBER = re.compile(r"([XYE])(-?[\d.]+)")


class Printed:
    """The lines that G-code with absolute or relative extrusion lays: lengths, widths, heights [mm], kinds, volume."""

    def __init__(self, text):
        now = dict.fromkeys(("TYPE", "WIDTH", "HEIGHT"), "0")
        at, is_relative, rows = {"X": 0.0, "Y": 0.0, "E": 0.0}, "\nM83" in text, []
        self.objects = re.findall(r"^; printing object (.+) id:", text, flags=re.MULTILINE)
        for line in text.splitlines():
            if told := _TOLD.match(line):
                now[told[1]] = told[2].strip()
            elif line.startswith("G92"):
                at["E"] = 0.0
            elif line.startswith("G1 "):
                to = {**at, **{axis: float(number) for axis, number in _NUMBER.findall(line.partition(";")[0])}}
                laid = (to["E"] if "E" in line else 0.0) if is_relative else to["E"] - at["E"]
                length = math.hypot(to["X"] - at["X"], to["Y"] - at["Y"])
                if laid > 0.0 and length:
                    rows.append((length, laid, *now.values()))
                at = to
        length, laid, kind, width, height = zip(*rows, strict=True)
        self.length, self.kinds = np.array(length), set(kind)
        self.width, self.height = np.array(width, dtype=float), np.array(height, dtype=float)
        self.volume = 0.25 * math.pi * FILAMENT_MM**2 * sum(laid)

    def common(self, values, near):
        """Return the median of values [mm] if nearly all lines are near it: else one object has another."""
        median = float(np.median(values))
        is_near = np.abs(values - median) < near
        return round(median, 2) if self.length[is_near].sum() > 0.95 * self.length.sum() else None

    def settings(self, solid_mm3):
        """Return what the lines show of the settings of a print, of a solid of this volume."""
        return {
            "layer": self.common(self.height, 0.01),
            "line width": self.common(self.width, 0.03),
            "filled": bool(0.99 < self.volume / solid_mm3 < 1.04),
            "support or brim": bool(self.kinds & {"Support material", "Skirt/Brim"}),
        }


def sliced(path, folder, *options):
    """Return what PrusaSlicer prints of a file with options of the profile; the first layer is 0.2 mm high."""
    first = ("--first-layer-height", "0.2", "--first-layer-extrusion-width", "0.4", "--skirts", "0")
    command = ["prusa-slicer", "--export-gcode", *first, *options, "--output", str(folder / "part.gcode"), str(path)]
    subprocess.run(command, capture_output=True, timeout=DEADLINE_S, check=True)
    return Printed((folder / "part.gcode").read_text(encoding="utf-8"))

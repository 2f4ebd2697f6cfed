"""Settings of a print as its G-code shows them: what PrusaSlicer writes at its end is those of the profile."""

import math
import re
import subprocess
from collections import defaultdict

import numpy as np
from deadline import DEADLINE_S

FILAMENT_MM = 1.75  # as PrusaSlicer has it where nothing is set
_TOLD = re.compile(r";(TYPE|WIDTH|HEIGHT|Z):(.*)")
_NUMBER = re.compile(r"([XYE])(-?[\d.]+)")


class Printed:
    """The lines that G-code lays [mm]: lengths, directions [deg], widths, heights, kinds and levels, and their volume.

    `corners` has the points of the outer perimeters of each level, `objects` the names of what is printed.
    """

    def __init__(self, text):
        """Read the text of a program with absolute or relative extrusion."""
        now = dict.fromkeys(("TYPE", "WIDTH", "HEIGHT", "Z"), "0")
        at, is_relative, rows = {"X": 0.0, "Y": 0.0, "E": 0.0}, "\nM83" in text, []
        self.corners = defaultdict(list)
        self.objects = re.findall(r"^; printing object (.+) id:", text, flags=re.MULTILINE)
        for line in text.splitlines():
            if told := _TOLD.match(line):
                now[told[1]] = told[2].strip()
            elif line.startswith("G92"):
                at["E"] = 0.0
            elif line.startswith("G1 "):
                to = {**at, **{axis: float(number) for axis, number in _NUMBER.findall(line.partition(";")[0])}}
                laid = (to["E"] if "E" in line else 0.0) if is_relative else to["E"] - at["E"]
                dx, dy = to["X"] - at["X"], to["Y"] - at["Y"]
                if laid > 0.0 and (dx or dy):
                    rows.append((math.hypot(dx, dy), math.degrees(math.atan2(dy, dx)) % 180.0, laid, *now.values()))
                    if now["TYPE"] == "External perimeter":
                        self.corners[float(now["Z"])].append((to["X"], to["Y"]))
                at = to
        length, angle, laid, kind, width, height, level = zip(*rows, strict=True)
        self.length, self.angle = np.array(length), np.array(angle)
        self.kind = np.array(kind)
        self.width, self.height, self.level = (np.array(column, dtype=float) for column in (width, height, level))
        self.volume = 0.25 * math.pi * FILAMENT_MM**2 * sum(laid)

    def share(self, chosen, of=True):
        """Return the share of the length of lines that are chosen, of all or of some."""
        return float(self.length[chosen & of].sum() / self.length[of & (self.length > 0.0)].sum())

    def common(self, values, near):
        """Return the median of values [mm] if nearly all lines are near it: else one object has another."""
        median = float(np.median(values))
        return round(median, 2) if self.share(np.abs(values - median) < near) > 0.95 else None

    def settings(self, solid_mm3):
        """Return what the lines show of the settings of a print, of a solid of this volume."""
        infill = self.kind == "Internal infill"
        first, second = (np.array(self.corners[level]) for level in sorted(self.corners)[:2])
        return {
            "layer": self.common(self.height, 0.01),
            "line width": self.common(self.width, 0.03),
            "filled": bool(0.99 < self.volume / solid_mm3 < 1.04),
            "rectilinear": self.share(np.abs(self.angle % 90.0 - 45.0) < 1.0, infill) > 0.8,
            "perimeters": 1
            + math.ceil(self.share(self.kind == "Perimeter") / self.share(self.kind == "External perimeter")),
            "foot": round(float(np.ptp(second, axis=0).mean() - np.ptp(first, axis=0).mean()) / 2.0, 2),
            "support or brim": bool(np.isin(self.kind, ("Support material", "Skirt/Brim")).any()),
        }


def sliced(path, folder, *options):
    """Return what PrusaSlicer prints of a file with options of the profile; the first layer is 0.2 mm high."""
    first = ("--first-layer-height", "0.2", "--first-layer-extrusion-width", "0.4", "--skirts", "0")
    command = ["prusa-slicer", "--export-gcode", *first, *options, "--output", str(folder / "part.gcode"), str(path)]
    subprocess.run(command, capture_output=True, timeout=DEADLINE_S, check=True)
    return Printed((folder / "part.gcode").read_text(encoding="utf-8"))

"""Firmware: a C header and a MicroPython module with the constants of one calibrated unit, to read a press on a board.

Both files do without a heap, and need no library except the mathematical one. This script runs the MicroPython module
in Python.
"""

import runpy
import subprocess
import sys
from pathlib import Path

import twintip

FILES = Path(__file__).parents[1] / "docs" / "examples"
OUT = Path("outputs/my-fruit-look")
UNIT = Path("outputs/unit.toml")
HEADER = Path("outputs/sensor.h")
MODULE = Path("outputs/sensor.py")

design = twintip.load_design(FILES / "my-fruit.toml")
twintip.run(design, twintip.RunOptions(out=OUT, look=True, tolerance=0.02))
calibrate = ["calibrate", OUT, FILES / "weights.csv", "--out", UNIT]
write = ["read", OUT, "--unit", UNIT, "--c-header", HEADER, "--micropython", MODULE]
for command in (calibrate, write):
    subprocess.run([sys.executable, "-m", "twintip", *command, "--force"], check=True, capture_output=True)

header = HEADER.read_text(encoding="utf-8")
print(
    f"{HEADER.name}: some {round(len(header.splitlines()), -2)} lines of C99, {header.count('malloc')} calls of malloc"
)

lines = (FILES / "press-counts.csv").read_text(encoding="utf-8").splitlines()[1:]
counts = [[int(cell) for cell in line.split(",")[1:]] for line in lines]
for E, _, _ in runpy.run_path(str(MODULE))["readings"](counts):
    print(f"{MODULE.name}: {len(counts)} samples of counts read E {E:.2f} MPa")
print("the fruit has 1.5 MPa")

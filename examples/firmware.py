"""Firmware: the constants of one calibrated unit as a C header and a MicroPython module, which reads a press.

Neither needs a heap or a library but the one of mathematics. The module runs in this Python as on a microcontroller.
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
    subprocess.run([sys.executable, "-m", "pipeline", *command, "--force"], check=True, capture_output=True)

header = HEADER.read_text(encoding="utf-8")
print(f"{HEADER.name}: {len(header.splitlines())} lines of C99, {header.count('malloc')} calls of malloc")

press = runpy.run_path(str(MODULE))["Press"]()
forces = [line.split(",")[2:] for line in (FILES / "press.csv").read_text(encoding="utf-8").splitlines()[1:]]
for line in forces:
    press.add([float(force) for force in line])
E, *_ = press.read()
print(f"{MODULE.name}: {len(forces)} samples read E {E:.2f} MPa")

(reading,) = twintip.read_press(twintip.read_report(OUT), FILES / "press.csv", UNIT)
print(f"twintip.read_press reads E {reading.E:.2f} MPa from the same forces")

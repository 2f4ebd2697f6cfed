"""A press read: one press on a fruit, read with the springs as designed and with those of the calibrated unit.

The design is that of the tutorial. Its print is 8 to 15 % too stiff, so only the calibrated unit reads E correctly.
"""

import subprocess
import sys
from pathlib import Path

import twintip

FILES = Path(__file__).parents[1] / "docs" / "examples"
OUT = Path("outputs/my-fruit-look")
UNIT = Path("outputs/unit.toml")

design = twintip.load_design(FILES / "my-fruit.toml")
twintip.run(design, twintip.RunOptions(out=OUT, look=True, tolerance=0.02))
calibrate = ["calibrate", OUT, FILES / "weights.csv", "--out", UNIT, "--classes", "ripe:1.1,turning:2.3,unripe"]
subprocess.run([sys.executable, "-m", "twintip", *calibrate, "--force"], check=True, capture_output=True)

report = twintip.read_report(OUT)
for title, unit in (("as designed", None), ("calibrated", UNIT)):
    for reading in twintip.read_press(report, FILES / "press.csv", unit):
        print(f"{title:12} E {reading.E:.2f} MPa ± {100.0 * reading.u:.0f} %", end="")
        print(f"   tilt {reading.tilt:.1f} deg   class {reading.ripeness}   flags {', '.join(reading.flags) or 'none'}")
print("the fruit has 1.5 MPa, and the sensor is tilted by 0.6 degrees")

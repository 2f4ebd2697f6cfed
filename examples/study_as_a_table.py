"""A study as a table: many designs that differ from one base, each solved once, as columns in NumPy.

The study in springs.toml varies the targets in every print process. `pandas.read_csv` can read its table too.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np

STUDY = Path(__file__).with_name("springs.toml")
OUT = Path("outputs/springs")
TABLE = Path("outputs/springs.csv")

OUT.parent.mkdir(exist_ok=True)
command = [sys.executable, "-m", "twintip", "study", STUDY, "--out", OUT, "--export", TABLE, "--force"]
subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

table = np.genfromtxt(TABLE, delimiter=",", names=True, dtype=None, encoding="utf-8", deletechars="")
print(f"{len(table)} designs, columns: {', '.join(table.dtype.names)}\n")
process = table["print.process"]
length = table["springs.beam_law_leaves_mm.0"]  # of the leaves of the low spring
printable = table["verdicts.printable.low.passed"] & table["verdicts.printable.high.passed"]
for name in np.unique(process):
    rows = process == name
    made = f"{np.sum(rows & printable):2} of {rows.sum()} can be printed"
    print(f"{name:12} {made}, low leaves {length[rows].min():.1f} to {length[rows].max():.1f} mm")

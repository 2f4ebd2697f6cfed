"""A study as a table: many designs that differ from one base, each solved once, as columns in NumPy.

The study in springs.toml varies the targets in every print process. `pandas.DataFrame` takes its table too.
"""

from pathlib import Path

import numpy as np

import twintip

study = twintip.read_study(Path(__file__).with_name("springs.toml"))
with twintip.process_engine(processes=2) as engine:
    solved = twintip.run_study(study, Path("outputs/springs"), engine)

table = {name: np.array(column) for name, column in solved.table().items()}
print(f"{solved.points} designs, columns: {', '.join(table)}\n")
process = table["print.process"]
length = table["springs.beam_law_leaves_mm.0"]  # of the leaves of the low spring
# None stands for undecided, which is not printable yet.
low, high = (table[f"verdicts.printable.{spring}.passed"].astype(bool) for spring in ("low", "high"))
for name in np.unique(process):
    rows = process == name
    made = f"{np.sum(rows & low & high):2} of {rows.sum()} can be printed"
    print(f"{name:12} {made}, low leaves {length[rows].min():.1f} to {length[rows].max():.1f} mm")

best = solved.best  # the first of the wanted keys is the least: the low spring is the softest
print(f"\nsoftest low spring: {best['springs.K_l_N_per_m']:.0f} N/m, point {best['number']} in {best['print.process']}")

"""The files that the examples of the documents name: a run of a pair that was not solved, a press of it and weights."""

import re
from pathlib import Path

from stand_ins import result_of

from pipeline.report.outputs import write_outputs
from sensor.quantity import STANDARD_GRAVITY

ROOT = Path(__file__).parents[1]
STIFFNESS = {"low": 1.0, "high": 22.0}  # [N/mm] of the printed springs


def write_example_files(folder: Path) -> None:
    """Write `outputs/mine`, `press.csv` as docs/read-a-fruit.md shows it, and `weights.csv` of up to 100 g."""
    out = folder / "outputs" / "mine"
    out.mkdir(parents=True)
    write_outputs(result_of(), out)
    page = (ROOT / "docs" / "read-a-fruit.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^    t_s,x_mm,F_l_N,F_h_N\n(?:    .+\n)+", page, flags=re.MULTILINE)
    (folder / "press.csv").write_text(re.sub(r"^    ", "", table, flags=re.MULTILINE), encoding="utf-8")
    rows = ["tip,weight_g,deflection_mm"]
    for tip, K in STIFFNESS.items():
        rows += [f"{tip},{grams},{1e-3 * STANDARD_GRAVITY * grams / K}" for grams in (0, 20, 50, 100)]
    (folder / "weights.csv").write_text("\n".join(rows), encoding="utf-8")

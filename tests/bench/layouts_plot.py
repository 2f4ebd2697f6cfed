"""Draw docs/layouts.svg, the error of one reading against tilt, from the table of docs/layouts.md.

`python tests/bench/layouts_plot.py` draws the rows on flesh of 12 mm; run it after `python tests/bench/layouts.py`.
"""

import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

DOCS = Path(__file__).parents[2] / "docs"
SHOWN = {
    ("two tips, spacing 8", "force ratio"): "pair, force ratio",
    ("two tips, spacing 8", "slope after touch"): "pair, line over the press",
    ("L-H-L, outer tips longer", "contrast"): "line L-H-L",
    ("H-L-H, outer tips longer", "contrast"): "line H-L-H",
    ("square, flat 1, side 4", "contrast"): "square, flat tips",
    ("square, domes r 1, side 4", "contrast"): "square, domes",
}
BODY = "flesh of 12 mm"
PUBLISHED = 4.0  # % up to 8 deg, a published sensor of three tips
STYLE: Any = {"svg.hashsalt": "twintip", "svg.fonttype": "none", "font.size": 9.0}


def curves(page: str) -> dict[str, list[tuple[float, float]]]:
    """Return tilt [deg] and error [%] of each layout shown; a cell without a number has no point."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if line.startswith("|")]
    tilts = [float(cell.removesuffix(" deg")) for cell in rows[0][3:]]
    found = {}
    for layout, read, body, *cells in rows[2:]:
        name = SHOWN.get((layout, read))
        if name is not None and body == BODY:
            numbers = [re.match(r"[\d.]+", cell) for cell in cells]
            found[name] = [(tilt, float(number[0])) for tilt, number in zip(tilts, numbers, strict=True) if number]
    return found


def main() -> None:
    """Draw the picture."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.add_subplot()
        for name, points in curves((DOCS / "layouts.md").read_text(encoding="utf-8")).items():
            axes.semilogy(*zip(*points, strict=True), "o-", label=name)
        axes.axhline(PUBLISHED, color="#888888", linestyle="--", label="published, three tips")
        axes.set(xlabel="tilt [deg]", ylabel="largest |E read / E - 1| [%]")
        axes.grid(visible=True, color="#dddddd")
        axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        figure.savefig(DOCS / "layouts.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()

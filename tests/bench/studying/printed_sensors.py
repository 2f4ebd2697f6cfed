"""How prints of a sensor scatter: python tests/bench/studying/printed_sensors.py 10000, for docs/studies.md.

A study of so many prints of the paper's sensor beside two bands of the same two scatters: the linear one, by the
derivatives of the law at the drawing, and that of `pipeline design`, whose stiffness over thickness is by finite
elements. Each band holds the middle 95 %.
"""

import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.stats import norm

from cad.design.parameters import Design
from cad.theory.two_spring_law import Springs, force_ratio, nonlinearity
from pipeline.options import RunOptions, load_design
from pipeline.response.contact import fruit_compliance
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.study import process_engine, read_study, run_study
from pipeline.study.levels.printed import PrintMiss, printed_sizing
from pipeline.study.store import stored_study

WIDTH = float(norm.ppf(0.975))  # of the middle 95 %, in standard deviations
LINEAR_WITHIN = 0.05  # an end of a band that lies within this share of its half width is called linear
STEP = 1e-4  # of a derivative, in standard deviations
TEXT = """
base = "paper"
samples = {samples}
seed = 1
wanted = ["springs.K_l_N_per_m", "springs.K_h_N_per_m", "verdicts.P_max.value", "verdicts.NL.value"]
[vary]
"printed.thickness_offset_mm" = {{ mean = 0.0, sd = {thickness}, source = "accuracy_mm of the process, two sigma" }}
"printed.E_offset" = {{ mean = 0.0, sd = {E}, source = "E_scatter of the process" }}
"""
HEAD = """| number | drawn | mean | sd | linear sd | 95 % of {samples} prints | linear | `pipeline design` | linear? |
|---|---|---|---|---|---|---|---|---|"""
NAMES = {"springs.K_l_N_per_m": "K_l_N_per_m", "springs.K_h_N_per_m": "K_h_N_per_m", "verdicts.P_max.value": "P_max",
         "verdicts.NL.value": "NL"}  # fmt: skip


def main() -> None:
    """Print a row for each number."""
    samples = int(sys.argv[1])
    design = load_design("paper")
    sds = 0.5 * design.process.accuracy_mm, design.process.E_scatter
    sizing = spring_sizing(design, fruit_compliance(design, RunOptions()), RunOptions())
    print(HEAD.format(samples=samples))
    with tempfile.TemporaryDirectory() as name:
        columns = prints(Path(name), samples, sds)
        bands = bands_of_design(Path(name) / "design")
    for key, function in numbers(design, sizing).items():
        print(row(NAMES[key], function, columns[key], sds, bands[NAMES[key]]))


def prints(folder: Path, samples: int, sds: tuple[float, float]) -> dict[str, np.ndarray]:
    """Return what a study of so many prints gives for each number, shape (samples,)."""
    path = folder / "prints.toml"
    path.write_text(TEXT.format(samples=samples, thickness=sds[0], E=sds[1]), encoding="utf-8")
    with process_engine() as engine:
        run_study(read_study(path), folder / "out", engine)
    with stored_study(folder / "out") as store:
        rows = [row for row in store.rows() if row.status == "done"]
    return {key: np.array([row.values[key] for row in rows], dtype=float) for key in NAMES}


def bands_of_design(folder: Path) -> dict[str, list[float]]:
    """Return the bands that `pipeline design` writes for the same sensor."""
    subprocess.run([sys.executable, "-m", "pipeline", "design", "--out", str(folder)], check=True, capture_output=True)
    bands: dict[str, list[float]] = json.loads((folder / "report.json").read_text(encoding="utf-8"))["tolerance"]
    return bands


def numbers(design: Design, sizing: SpringSizing) -> dict[str, Callable[[float, float], float]]:
    """Return each number as a function of a print's thickness offset [mm] and relative offset of E [1]."""

    def springs(d: float, e: float) -> Springs:
        return printed_sizing(design, sizing, PrintMiss(thickness_mm=d, E=e)).springs

    K_m, ratio, kind = sizing.K_m_max_contact, sizing.stiffness_ratio, design.nominal_targets.NL_definition
    return {
        "springs.K_l_N_per_m": lambda d, e: 1e3 * springs(d, e).K_l,
        "springs.K_h_N_per_m": lambda d, e: 1e3 * springs(d, e).K_h,
        "verdicts.P_max.value": lambda d, e: force_ratio(springs(d, e), K_m, ratio),
        "verdicts.NL.value": lambda d, e: nonlinearity(springs(d, e), K_m, kind, ratio),
    }


def row(
    name: str,
    function: Callable[[float, float], float],
    values: np.ndarray,
    sds: tuple[float, float],
    band: list[float],
) -> str:
    """Return the row of a number: what prints give, what the derivatives at the drawing say, and pipeline design."""
    drawn, (d, e) = function(0.0, 0.0), sds
    by_thickness = (function(STEP * d, 0.0) - function(-STEP * d, 0.0)) / (2.0 * STEP)
    by_modulus = (function(0.0, STEP * e) - function(0.0, -STEP * e)) / (2.0 * STEP)
    sd = math.hypot(by_thickness, by_modulus)
    linear = drawn - WIDTH * sd, drawn + WIDTH * sd
    ends = np.quantile(values, [0.025, 0.975])
    misses = (ends - linear) / (WIDTH * sd)
    words = (
        f"{'yes' if np.abs(misses).max() <= LINEAR_WITHIN else 'no'}: ends off by {misses[0]:+.0%} and {misses[1]:+.0%}"
    )
    cells = [name, f"{drawn:.5g}", f"{values.mean():.5g}", f"{values.std(ddof=1):.4g}", f"{sd:.4g}"]
    cells += [f"{low:.5g} to {high:.5g}" for low, high in (ends, linear, band)]
    return f"| {' | '.join([*cells, words])} |"


if __name__ == "__main__":
    main()

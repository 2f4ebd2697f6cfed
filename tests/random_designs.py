"""Designs at random in every process, with the tips, mounts and layouts for which springs are made."""

from collections.abc import Iterator

import numpy as np

from pipeline.options import RunOptions, load_design
from pipeline.response.contact import fruit_compliance
from pipeline.sensor import refuse_unsolvable
from pipeline.springs.fitted_springs import printable_leaves
from pipeline.springs.sizing import spring_sizing
from sensor.design.parameters import Design
from sensor.design.processes import PROCESSES
from sensor.quantity import InputError

ROUGH = RunOptions(tolerance=0.02)


def random_designs(seed: int) -> Iterator[Design]:
    """Yield designs whose springs the beam law lets print."""
    rng = np.random.default_rng(seed)
    while True:
        try:
            design = load_design("paper", settings(rng))
            refuse_unsolvable(design)
            sizing = spring_sizing(design, fruit_compliance(design, ROUGH), ROUGH)
        except InputError:
            continue
        if all(leaves.passed is not False for leaves in printable_leaves(design, sizing).values()):
            yield design


def settings(rng: np.random.Generator) -> dict[str, object]:
    """Return keys of a design file with their values."""
    layout = str(rng.choice(["pair", "pair", "pair", "square"]))
    shape = str(rng.choice(["cube", "cylinder", "dome"]))
    side = round(rng.uniform(0.8, 3.0), 2)
    E_max = _spread(rng, 0.3, 12.0)
    keys = {
        "targets.P_max": _spread(rng, 1.8, 12.0),
        "targets.NL": _spread(rng, 0.02, 0.2),
        "fruit.E_max_MPa": E_max,
        "fruit.E_MPa": [0.2 * E_max, 0.5 * E_max, E_max],
        "tips.layout": layout,
        "tips.shape": shape,
        "tips.side_mm": side,
        "tips.spacing_mm": round(rng.uniform(side + 2.5, 9.0), 2),
        "press.travel_mm": round(rng.uniform(0.2, 0.6), 2),
        "print.process": str(rng.choice(list(PROCESSES))),
        "print.mount": str(rng.choice(["covers", "washers"])),
    }
    if shape == "dome":
        keys["tips.dome_radius_mm"] = round(side * rng.uniform(0.8, 2.0), 2)
    elif (layout == "pair" and rng.random() < 0.2) or shape == "cylinder":  # no process prints a cylinder
        keys["tips.socket"] = "pin"
    return keys


def _spread(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number of four digits between two ends, evenly in its logarithm."""
    return float(f"{np.exp(rng.uniform(np.log(low), np.log(high))):.4g}")

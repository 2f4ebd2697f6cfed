"""ROUNDING: loss of stiffness over edge radius / side, by unilateral contact of a rounded tip against a sharp one.

`python tests/fits/rounded_edge.py` (10 s). At the very first touch only the flat part of the face carries: a smaller
sharp tip, 2.03 on the paper's block; deeper, the fillet carries too. ROUNDING is the loss 0.01 sides deep.
"""

import sys
from functools import cache
from pathlib import Path
from unittest.mock import patch

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from fits.comparison import Comparison, fitted  # noqa: E402

from cad.design.parameters import Fruit, Press, Tips  # noqa: E402
from pipeline.uncertainty import causes  # noqa: E402
from solve.contact.response import scene_response  # noqa: E402
from solve.contact.scene import CELLS, Scene  # noqa: E402
from solve.fruit.split import split_compliance  # noqa: E402

FRUIT = Fruit()
RADII = (0.05, 0.1)  # [sides]
DEPTHS = np.array([0.01, 0.02, 0.05, 0.1, 0.3])  # [sides]
GRID = (40, 60)  # cells a side, coarse and fine
STIFF = 1e-9 * np.eye(2)  # [mm/N] of the springs


def first_touch(radius: float) -> float:
    """Return the loss over the edge radius [sides] where the flat part alone carries."""
    sharp, flat = (split_compliance(FRUIT, Tips(side_mm=side)).S for side in (1.0, 1.0 - 2.0 * radius))
    return float(1.0 - (sharp[0][0] + sharp[0][1]) / (flat[0][0] + flat[0][1])) / radius


@cache
def losses(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the loss over the edge radius [sides] at each depth, and its error bar, both of shape (depths,)."""
    compliance = split_compliance(FRUIT, Tips())
    with patch.dict(CELLS, {"mirrored": GRID}):
        sharp, round_ = (
            scene_response(
                Scene(fruit=FRUIT, tips=Tips(fillet_mm=fillet), press=Press()), compliance, STIFF, [1.0], DEPTHS
            )
            for fillet in (0.0, radius)
        )
    return (1.0 - round_.F[0] / sharp.F[0]).mean(axis=1) / radius, round_.F_error[0] / radius


def compared() -> list[Comparison]:
    values, errors = zip(*(losses(radius) for radius in RADII), strict=True)
    value, scatter = float(np.mean(values, axis=0)[0]), float(np.max(errors, axis=0)[0])
    return [fitted("ROUNDING, 0.01 sides deep", causes.ROUNDING, value, scatter)]


if __name__ == "__main__":
    for radius in RADII:
        loss, error = losses(radius)
        print(f"radius {radius:g} sides: {first_touch(radius):.3f} at first touch")
        print(
            "\n".join(f"    {d:g} sides deep: {a:.3f} +- {b:.3f}" for d, a, b in zip(DEPTHS, loss, error, strict=True))
        )
    print(*compared(), sep="\n")

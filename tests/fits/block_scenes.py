"""Blocks of fruit under two tips, solved by the split on one mesh of the caller's choice."""

from functools import cache
from unittest.mock import patch

import numpy as np

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from solve.fruit.box import Grading
from solve.fruit.compliance import FruitCompliance
from solve.fruit.split import split_compliance

Scene = tuple[Fruit, Tips]
MUCH = 1e3  # sides: extents of a block that is as good as a half-space


def block(
    height: float, poisson: float = 0.3, *, length: float = 20.0, width: float = 20.0, spacing: float = 8.0
) -> Scene:
    """Return a block [mm] under two tips of 1 mm."""
    fruit = Fruit(length_mm=length, width_mm=width, height_mm=height, poisson=poisson)
    return fruit, Tips(spacing_mm=spacing)


@cache
def on_mesh(scene: Scene, grading: Grading) -> FruitCompliance:
    """Return the compliance on the mesh of this grading alone, whatever its error; raises SolveError."""
    with patch.multiple("solve.fruit.split", LEVELS=(grading,), LARGEST_ERROR=1.0):
        return split_compliance(*scene)


def paired(found: FruitCompliance) -> float:
    """Return the mean of s11 and s22 less s12, times E [1/mm]."""
    return float(0.5 * (found.S[0][0] + found.S[1][1]) - found.S[0][1])


def random_scenes(count: int, seed: int) -> list[Scene]:
    """Draw blocks with tips of 1 mm: edges 1.5 to 8 sides away, 1 to 10 sides high, tips 1.2 to 8 sides apart."""
    rng = np.random.default_rng(seed)
    scenes = []
    for _ in range(count):
        gap, height, spacing = rng.uniform(1.5, 8.0, 2), rng.uniform(1.0, 10.0), rng.uniform(1.2, 8.0)
        size = {"length": float(spacing + 1.0 + 2.0 * gap[0]), "width": float(1.0 + 2.0 * gap[1])}
        scenes.append(block(float(height), float(rng.uniform(0.0, 0.49)), spacing=float(spacing), **size))
    return scenes

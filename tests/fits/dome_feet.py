"""ELSEWHERE of the law of domes: what a block adds to a half-space where domes touch nearer together, or aside.

`python tests/fits dome_feet` (half a minute): its change over itself and over the growth of the square of the way from
the middle, in sizes of the block, for squares on deep and shallow flesh.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from fits.comparison import Comparison, covering

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from solve.contact.domes.law import ELSEWHERE
from solve.fruit.footprints import Footprint, level_compliance, nodes_between
from solve.fruit.split import LEVELS, contact_footprints, footprint_compliance

FRUITS = (Fruit(), Fruit(height_mm=8.0), Fruit(poisson=0.45), Fruit(length_mm=40.0, width_mm=40.0))
TIPS = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=4.6, spacing_mm=4.8)
# How the places of the domes are stretched, and how far they are moved along x [mm].
MOVES = ((0.95, 0.0), (0.9, 0.0), (1.0, 0.5), (1.0, 2.0), (0.95, 1.0))


def added(fruit: Fruit, footprints: Sequence[Footprint]) -> np.ndarray:
    """Return what a block adds to a half-space times E [1/mm], (tips, tips)."""
    none = np.zeros(())
    half_space = level_compliance(footprints, fruit.poisson, none, nodes_between(footprints))
    return footprint_compliance(fruit, footprints, LEVELS[0]).S - half_space


def over_growth(fruit: Fruit) -> list[float]:
    """Return the largest change over itself and over the growth [1] in each move."""
    footprints = contact_footprints(fruit, TIPS)
    size = min(fruit.height_mm, *(footprint.room(fruit) for footprint in footprints))
    unmoved = added(fruit, footprints)
    ratios = []
    for stretch, aside in MOVES:
        moved = [replace(each, x=stretch * each.x + aside, y=stretch * each.y) for each in footprints]
        feet, new_feet = (np.array([(each.x, each.y) for each in places]) for places in (footprints, moved))
        way = np.linalg.norm(new_feet - feet, axis=1)
        growth = float((way * (way + 2.0 * np.linalg.norm(feet, axis=1))).max()) / size**2
        ratios.append(float(np.abs((added(fruit, moved) - unmoved) / unmoved).max() / growth))
    return ratios


def compared(fruits: Sequence[Fruit] = FRUITS) -> list[Comparison]:
    ratios = [ratio for fruit in fruits for ratio in over_growth(fruit)]
    return [covering("change where domes touch elsewhere", ELSEWHERE, ratios)]

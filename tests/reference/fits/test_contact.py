"""The constant of the block under domes that touch elsewhere than where it was solved."""

from dataclasses import replace

import numpy as np
import pytest
from covering import covers

from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.contact.domes.law import MOVED_CONTACT_FACTOR
from solve.fruit.footprints import level_compliance, nodes_between
from solve.fruit.split import LEVELS, contact_footprints, footprint_compliance

pytestmark = pytest.mark.study


def test_what_a_block_adds_changes_where_domes_touch_elsewhere_as_the_square_of_their_way():
    fruit = Fruit()
    tips = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=4.6, spacing_mm=4.8)
    feet = contact_footprints(fruit, tips)
    size = min(fruit.height_mm, *(each.distance_to_edge(fruit) for each in feet))

    def added(footprints):
        half_space = level_compliance(footprints, fruit.poisson, np.zeros(()), nodes_between(footprints))
        return footprint_compliance(fruit, footprints, LEVELS[0]).S - half_space

    unmoved = added(feet)
    ratios = []
    for stretch, aside in ((0.95, 0.0), (0.9, 0.0), (1.0, 0.5), (1.0, 2.0), (0.95, 1.0)):
        moved = [replace(each, x=stretch * each.x + aside, y=stretch * each.y) for each in feet]
        ways = [np.hypot(new.x - old.x, new.y - old.y) for old, new in zip(feet, moved, strict=True)]
        growth = max(way * (way + 2.0 * np.hypot(foot.x, foot.y)) for way, foot in zip(ways, feet, strict=True))
        ratios.append(np.abs((added(moved) - unmoved) / unmoved).max() / (growth / size**2))
    assert covers(MOVED_CONTACT_FACTOR, ratios)

"""Constants of contact: cells against finer cells, and the block under domes that touch elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from covering import covers

from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from solve.contact import response
from solve.contact.domes.law import ELSEWHERE
from solve.contact.linear_response import spring_compliance
from solve.contact.scene import Scene
from solve.contact.scene_cells import HALF_CELLS
from solve.fruit.footprints import level_compliance, nodes_between
from solve.fruit.split import LEVELS, contact_footprints, footprint_compliance, split_compliance

pytestmark = pytest.mark.study

ORDER = 1.5  # of the cells' error in their number
MODULI = np.array([0.5, 3.5])


@pytest.mark.parametrize(
    "scenes",
    [
        pytest.param(((Tips(), 1.0), (Tips(fillet_mm=0.05), 0.0)), id="tilted and rounded"),
        pytest.param(((Tips(shape="sphere"), 1.0),), id="sphere"),
    ],
)
def test_bar_of_the_cells_covers_their_error(scenes, monkeypatch):
    """The bar takes the largest step near by, and few scenes are looked at."""
    assert pytest.approx(1.0 / ((HALF_CELLS[1] / HALF_CELLS[0]) ** ORDER - 1.0), abs=0.2) == response.SAFETY
    compliance = split_compliance(Fruit(), Tips())
    springs = spring_compliance(0.906, 20.83)
    filled = []
    for tips, tilt in scenes:
        scene = Scene(fruit=Fruit(), tips=tips, press=PressMotion(tilt_deg=tilt))
        pressed = (scene, compliance, springs, MODULI, np.linspace(0.1, 0.6, 6))
        found = response.scene_response(*pressed)
        with monkeypatch.context() as finer:
            finer.setattr("solve.contact.scene_cells.HALF_CELLS", (34, 48))
            truth = response.scene_response(*pressed).F
        touching = (found.F > 0.0) & (truth > 0.0)
        errors = np.abs(np.divide(found.F, truth, out=np.ones_like(truth), where=touching) - 1.0).max(axis=2)
        filled.append(np.nanmax(errors / found.F_error))
    assert covers(1.0, filled, 5.0)


def test_what_a_block_adds_changes_where_domes_touch_elsewhere_as_the_square_of_their_way():
    fruit = Fruit()
    tips = Tips(layout="square", shape="dome", dome_radius_mm=10.0, side_mm=4.6, spacing_mm=4.8)
    feet = contact_footprints(fruit, tips)
    size = min(fruit.height_mm, *(each.room(fruit) for each in feet))

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
    assert covers(ELSEWHERE, ratios)

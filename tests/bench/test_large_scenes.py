"""The page of random deep presses: the same for a seed, how they end is counted, and a bar that fails is seen."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scripts import loaded_script

from cad.design.tips import Tips
from solve.large_strain import grid
from solve.large_strain.flesh_law import FleshLaw

SCRIPT = Path(__file__).with_name("large_scenes.py")


@pytest.fixture(scope="module")
def large_scenes():
    return loaded_script(SCRIPT)


def shallow(large_scenes, **changes):
    """Return a press that is cheap: as deep as a single step."""
    scene = large_scenes.DeepScene(tips=Tips(), law=FleshLaw(), depth=0.02, slides=False)
    return replace(scene, **changes)


def test_presses_follow_the_seed_and_are_within_what_is_claimed(large_scenes):
    drawn = [[large_scenes.random_scene(rng) for _ in range(20)] for rng in map(np.random.default_rng, (1, 1, 2))]
    assert drawn[0] == drawn[1] != drawn[2]
    assert {scene.law.name for scene in drawn[0]} == {"neo-hooke", "hencky", "foam"}
    assert all(scene.depth <= 0.6 and scene.tips.fillet_mm <= 0.1 * scene.tips.side_mm for scene in drawn[0])


def test_press_is_held_against_the_finer_mesh_which_leaves_no_trace(large_scenes):
    growth = grid.GROWTH
    found = large_scenes.outcome(shallow(large_scenes))
    assert (found.end, len(found.shares), grid.GROWTH) == ("converged", 6, growth)
    assert large_scenes.covered([found]) == 1.0
    narrow = replace(found, shares=(0.5, 1.5, 0.9, 2.0))
    assert large_scenes.covered([narrow]) == 0.5
    assert large_scenes.whole_curves([found, narrow]) == (1, 2)


def test_depth_that_the_finer_mesh_misses_is_not_covered(large_scenes, monkeypatch):
    """A curve whose finer mesh ends at the second of six depths holds two of them at most."""
    original = large_scenes.pressed
    monkeypatch.setattr(large_scenes, "pressed", lambda press, depths: original(press, depths[:2]))
    found = large_scenes.outcome(shallow(large_scenes))
    assert found.shares[2:] == (np.inf,) * 4
    assert large_scenes.covered([found]) <= 2 / 6
    assert large_scenes.whole_curves([found]) == (0, 1)


def test_sharp_edge_that_slides_counts_as_refused(large_scenes):
    found = large_scenes.outcome(shallow(large_scenes, slides=True))
    assert found.end == "refused in one line"
    assert "\n" not in found.refused
    assert large_scenes.covered([found]) == 0.0


@pytest.mark.study
def test_bars_cover_random_presses(large_scenes):
    found = list(large_scenes.outcomes(6, seed=4))
    assert large_scenes.covered(found) >= 0.9

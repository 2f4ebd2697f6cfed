"""Each fitted constant against the script that recomputes it, on few designs and moderate meshes."""

from functools import partial

import pytest
from fits import (
    block_mesh,
    coarse_mesh,
    contact_cells,
    curve_errors,
    dome_feet,
    dome_law,
    dome_strain,
    frame_share,
    gauge_edges,
    glued_pin,
    large_strain_factors,
    locking,
    mesh_pairs,
    root_strain,
    split_errors,
)
from fits.comparison import covering, fitted
from fits.springs import EVERY, ODD, TITANIUM

from cad.theory.soft_tissue import large_strain_factor
from solve.large_strain.flesh_law import FleshLaw

FAMILY = (2.0, 1.0, 0.5)  # one mesh coarser than the product's: locks more
TO_SCALE_1 = 1.0  # good enough a reference for the mesh of scale 2
BLOCKS = (split_errors.BLOCKS["paper"], split_errors.BLOCKS["low"])

REDUCED = {
    "frame": frame_share.compared,
    "coarse mesh": coarse_mesh.compared,
    "cheapest pair": partial(mesh_pairs.compared, [mesh_pairs.CHEAPEST], [EVERY], TO_SCALE_1),
    "odd shapes": partial(mesh_pairs.compared, [mesh_pairs.CHEAPEST], [ODD], TO_SCALE_1),
    "default pair": partial(mesh_pairs.compared, [mesh_pairs.DEFAULT], [(TITANIUM,)]),
    "root strain": partial(root_strain.compared, (TITANIUM,)),
    "gauge edges": gauge_edges.compared,
    "glued pin": partial(glued_pin.compared, (("fdm-petg", 0.7), ("dmls-17-4ph", 1.0))),
    "locking": partial(locking.compared, (0.4999,), FAMILY),
    "block mesh": block_mesh.compared,
    "split": partial(split_errors.compared, BLOCKS, 8),
    "contact cells": partial(contact_cells.compared, contact_cells.PARTLY[::2], contact_cells.SPHERES[:1]),
    "curve errors": partial(curve_errors.compared, curve_errors.LAWS[:1], curve_errors.EDGES[:1]),
    "dome feet": partial(dome_feet.compared, dome_feet.FRUITS[:1]),
    "dome law": partial(dome_law.compared, (dome_law.GENTLE, dome_law.SHALLOW)),
    "dome strain": partial(dome_strain.compared, (0.3,), (0.0, 0.05), dome_strain.DOMES[:5]),
}


@pytest.mark.study
@pytest.mark.parametrize("compared", REDUCED.values(), ids=REDUCED)
def test_constant_is_what_its_script_recomputes(compared):
    rows = compared()
    assert rows
    assert [str(row) for row in rows if not row.holds] == []


@pytest.mark.slow
@pytest.mark.parametrize(("law", "poisson"), [("neo-hooke", 0.3), ("foam", 0.45)])
def test_factors_of_large_strain_are_what_their_script_recomputes(law, poisson):
    found = large_strain_factors.curve(FleshLaw(name=law, poisson=poisson))
    for depth in (0.1, 0.3, 0.6):
        # 4 decimals are written; round-off may change the path of an iteration, not where it ends.
        assert large_strain_factor(depth, poisson, law) == pytest.approx(float(found.factor(depth)), abs=6e-5)


def test_share_that_covers_too_little_or_far_too_much_does_not_hold():
    seen = (0.1, 0.2)
    assert [covering("share", share, seen).holds for share in (0.19, 0.2, 0.6, 0.61)] == [False, True, True, False]
    assert [fitted("number", value, 2.0, 0.1).holds for value in (1.8, 1.95, 2.2)] == [False, True, False]

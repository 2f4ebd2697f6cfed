"""The mount that the sheet describes: where it holds the frame, and what another one would change."""

import math
from dataclasses import replace

import numpy as np
import pytest
from skfem import ElementHexS2
from squares import square_housing
from stand_ins import PETG, default_housing

from benchmarks.other_mounts import mount_changes
from cad.parts.cover import WASHER_MM
from cad.parts.cover_solid import cover_part
from cad.parts.housing import SETBACK_MM
from mesh.housing.sweep import flexure_mesh
from pipeline.errors.causes import LARGEST_MOUNT_CHANGES
from pipeline.springs.leaf_lengths import COARSE
from pipeline.springs.mounts import COARSE_SCALE, mount_layers
from sensor.design.parameters import Design, Print
from solve.elasticity import vector_basis
from solve.housing.clamped_half import REDUCED
from solve.housing.elastic_layer import layer_matrix
from solve.housing.stiffness import tip_compliance

MATERIAL = (PETG.E_MPa, PETG.poisson)
CUT = 0.01  # of an area: what points on an element share out where an edge cuts through it
ROUND_OFF = 1e-6  # of a stiffness, ten times that of a solve


def layer_area(housing, layer):
    """Return the area under a layer [mm^2]: its stiffness across is E A / t."""
    basis = vector_basis(flexure_mesh(housing), ElementHexS2(), REDUCED)
    across = np.zeros(basis.N)
    across[np.concatenate([basis.nodal_dofs[1], basis.edge_dofs[1]])] = 1.0
    return across @ layer_matrix(basis, [layer], 1.0, 0.0) @ across * layer.thickness


def mounted(mount):
    return default_housing(Design(print=Print(mount=mount)))


def solved(housing, scale):
    return tip_compliance(flexure_mesh(housing, scale), *MATERIAL, mount_layers(housing))


@pytest.mark.parametrize("mount", ["covers", "washers"])
def test_layer_has_the_area_of_the_covers_rim_or_of_the_washers(mount):
    housing = mounted(mount)
    if mount == "covers":
        area = cover_part(housing).face_area("rim")
    else:
        area = math.pi * (WASHER_MM**2 - housing.hole_diameter**2)
    (layer,) = mount_layers(housing)
    assert layer_area(housing, layer) == pytest.approx(area, rel=CUT)


@pytest.mark.parametrize("mount", ["covers", "washers"])
def test_plate_of_a_square_is_held_by_its_own_mount_and_by_the_other_plate(mount):
    """Springs in parallel on two sides of a symmetric half: each layer is half as stiff, twice as thick, on both.

    Behind its back lie two pads, the other plate and what holds that.
    """
    housing = replace(square_housing(), mount=mount)
    own, twin = mount_layers(housing)
    (single,) = mount_layers(replace(housing, back_to_back=None))
    assert own.thickness == 2.0 * single.thickness
    assert bool(own.discs) == bool(single.discs)
    assert twin.thickness == pytest.approx(2.0 * (housing.back_to_back.gap + housing.depth + single.thickness))


def test_back_layer_has_the_area_of_the_pads():
    housing = square_housing()
    _, twin = mount_layers(housing)
    (foot, top), inner = (housing.cover_level, housing.top_level), 2.0 * (housing.wall_width - SETBACK_MM)
    wide, bar = housing.right - housing.left, housing.top_level - housing.cavity_level - SETBACK_MM
    area = inner * (top - foot) + (wide - inner) * bar - math.pi * housing.hole_diameter**2
    # The mesh has one of the two sides, and in a wide wall long elements.
    assert layer_area(housing, twin) == pytest.approx(area, rel=2.0 * CUT)


@pytest.mark.slow
def test_loose_twin_is_among_the_mounts_that_a_square_is_compared_with():
    """Springs are softer without it, by less than the covers press near the screws alone."""
    changes = mount_changes(square_housing(), *MATERIAL)
    loose = changes["the other plate loose"]
    assert all(-0.003 < change < 0.0 for change in loose)


def test_mounts_differ_by_more_than_the_bar_and_plastic_covers_are_the_softest():
    """A cover is 3 mm of plastic under the frame, a washer is steel, and no screw holds the walls of a hole."""
    covers, washers, holes = (
        np.array(solved(replace(mounted("covers"), mount=mount), COARSE).K) for mount in ("covers", "washers", "holes")
    )
    assert np.all(covers < washers)
    assert np.all(washers < holes)
    assert holes[1] / covers[1] - 1.0 > 5e-3


def test_change_to_another_mount_is_that_of_solving_it():
    covers = mounted("covers")
    changes = mount_changes(covers, *MATERIAL)
    own, washers = (np.array(solved(replace(covers, mount=mount), COARSE_SCALE).K) for mount in ("covers", "washers"))
    assert changes["washers on the frame, no covers"] == pytest.approx(washers / own - 1.0, abs=ROUND_OFF)
    for name in ("screws so loose that they bend", "covers that press near the screws alone"):
        assert max(changes[name]) < 0.0
    assert len(changes) == 3
    largest = np.abs(list(changes.values())).max(axis=0)
    assert np.all(largest < np.abs(LARGEST_MOUNT_CHANGES))

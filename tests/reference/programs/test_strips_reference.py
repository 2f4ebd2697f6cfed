"""Strips of sheet glued into a frame, against CalculiX on bodies that are joined by a fragment and meshed anew."""

import dataclasses

import pytest
from scenes import STRIP_HOUSING

from benchmarks.calculix import is_installed
from mesh.housing.sweep import flexure_mesh
from pipeline.springs.leaf_lengths import STRIP_PAIR, stiffness_on
from pipeline.springs.mounts import attached_to
from reference.strips_in_calculix import Sizes, calculix_stiffness
from solve.housing.stiffness import tip_compliance

PETG = (2000.0, 0.38)
HOUSING = dataclasses.replace(STRIP_HOUSING, tip_side=STRIP_HOUSING.depth)  # without tapers it is one profile, swept
COARSE = Sizes(slot=6, across=1, free=20, near=0.3, far=3.0)

pytestmark = [pytest.mark.study, pytest.mark.skipif(not is_installed(), reason="CalculiX is absent")]


@pytest.fixture(scope="module")
def found():
    meshes = (flexure_mesh(HOUSING, scale) for scale in (STRIP_PAIR.fine, STRIP_PAIR.coarse))
    return stiffness_on(STRIP_PAIR, HOUSING, *(tip_compliance(mesh, *PETG, attached_to(HOUSING)) for mesh in meshes))


def test_stiffness_is_that_of_calculix_on_the_assembled_bodies_inside_the_bar(found):
    """The bar is at most 0.3 % wide; a coarser mesh of the other program is too stiff, as conforming elements are."""
    fine, coarse = (calculix_stiffness(HOUSING, *PETG, sizes) for sizes in (Sizes(), COARSE))
    for K, truth, too_stiff, bar in zip(found.K, fine, coarse, found.error, strict=True):
        assert abs(K / truth - 1.0) < bar < 1.5e-3
        assert too_stiff > truth


def test_glue_twice_as_thick_is_outside_the_bar(found):
    """A planted fault: slots that are too wide by the gap on both faces."""
    wide = dataclasses.replace(HOUSING, clamp=dataclasses.replace(HOUSING.clamp, gap=2.0 * HOUSING.clamp.gap))
    for K, other, bar in zip(found.K, calculix_stiffness(wide, *PETG, COARSE), found.error, strict=True):
        assert abs(other / K - 1.0) > 3.0 * bar

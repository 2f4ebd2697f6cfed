"""Strips of sheet glued into a frame: against beams, against glue that does not hold, and against finer meshes."""

import dataclasses

import numpy as np
import pytest
from scenes import STRIP_HOUSING
from scipy.sparse import csc_matrix

from cad.parts.housing_solid import housing_part
from mesh.housing.blocks import GLUE, STRIP, counts
from mesh.housing.sweep import check_flexure_mesh, flexure_mesh, mesh_of_counts, stretch_leaves
from mesh.session import MeshError
from pipeline.springs.leaf_lengths import STRIP_PAIR, stiffness_on
from pipeline.springs.mounts import attached_to, insets
from sensor.theory.leaf_spring import pair_stiffness
from sensor.theory.strip_clamp import clamp_share, unbonded_loss
from solve.housing.clamped_half import PRESS, STRIP_DIGITS, clamped_half, weight_load
from solve.housing.inset import Inset, cells_of
from solve.housing.stiffness import tip_compliance, tip_means, tip_stiffnesses
from solve.linear import EPSILON, SolveError, factorise

PETG = (2000.0, 0.38)
CLAMP = STRIP_HOUSING.clamp
LEAVES = (STRIP_HOUSING.low, STRIP_HOUSING.high)
GIVES = [CLAMP.give(leaf.thickness, *PETG) for leaf in LEAVES]


@pytest.fixture(scope="module")
def coarsest_mesh():
    return flexure_mesh(STRIP_HOUSING, 4.0)


@pytest.fixture(scope="module")
def coarsest(coarsest_mesh):
    return tip_compliance(coarsest_mesh, *PETG, attached_to(STRIP_HOUSING))


@pytest.fixture(scope="module")
def coarse_mesh():
    return flexure_mesh(STRIP_HOUSING, 2.0)


@pytest.fixture(scope="module")
def coarse(coarse_mesh):
    return tip_compliance(coarse_mesh, *PETG, attached_to(STRIP_HOUSING))


def with_clamp(**changes):
    return dataclasses.replace(STRIP_HOUSING, clamp=dataclasses.replace(CLAMP, **changes))


def volume(mesh, cells):
    """Return the volume of straight cells of the half [mm^3]."""
    corners = mesh.p[:, mesh.t[:, cells]]
    return float(np.prod(corners.max(axis=1) - corners.min(axis=1), axis=0).sum())


def test_regions_are_the_strips_and_their_glue(coarsest_mesh):
    """Each strip is as long as its leaf and both clamps, with glue on both faces there; half the depth is meshed."""
    length = CLAMP.length
    strips = sum(2.0 * leaf.thickness * (leaf.length + 2.0 * length) * 0.5 * leaf.depth for leaf in LEAVES)
    glue = sum(2.0 * 4.0 * CLAMP.gap * length * 0.5 * leaf.depth for leaf in LEAVES)
    assert volume(coarsest_mesh, coarsest_mesh.subdomains[STRIP]) == pytest.approx(strips, rel=1e-9)
    assert volume(coarsest_mesh, coarsest_mesh.subdomains[GLUE]) == pytest.approx(glue, rel=1e-9)
    drawn = sum(strip.length * (strip.z[1] - strip.z[0]) for strip in STRIP_HOUSING.strips)
    assert 0.5 * LEAVES[0].depth * drawn == pytest.approx(strips, rel=1e-9)


def test_mesh_is_that_of_print_glue_and_strips_together(coarsest_mesh):
    size = housing_part(STRIP_HOUSING).size
    check_flexure_mesh(coarsest_mesh, size)
    wanted = STRIP_HOUSING.with_flexures(
        {
            "low": dataclasses.replace(STRIP_HOUSING.low, length=17.0),
            "high": dataclasses.replace(STRIP_HOUSING.high, length=11.5),
        }
    )
    moved = stretch_leaves(coarsest_mesh, STRIP_HOUSING, wanted)
    check_flexure_mesh(moved, housing_part(wanted).size)
    assert len(moved.subdomains[STRIP]) == len(coarsest_mesh.subdomains[STRIP])
    with pytest.raises(MeshError, match="volume"):  # a slot that is too short for its strip
        check_flexure_mesh(flexure_mesh(with_clamp(length=2.0), 4.0), size)


def test_stiffness_in_a_rigid_print_is_that_of_clamped_beams():
    """Strips without Poisson's ratio are beams; print and glue 3000 times stiffer leave 0.2 % to the clamps' give."""
    rigid = with_clamp(strip_E_MPa=333.0, strip_poisson=0.0, glue_E_MPa=1e6, glue_poisson=0.0)
    found = tip_compliance(flexure_mesh(rigid, 4.0), 1e6, 0.0, attached_to(rigid)).K
    beams = [pair_stiffness(333.0, leaf.depth, leaf.thickness, leaf.length) for leaf in LEAVES]
    np.testing.assert_allclose(found, beams, rtol=3e-3)


def test_print_and_glue_have_their_share_in_the_stiffness(coarsest, coarsest_mesh):
    """K goes with E^s: print and glue 10 % stiffer, against the beam on a foundation, which is good to a fifth."""
    stiffer = with_clamp(glue_E_MPa=1.1 * CLAMP.glue_E_MPa)
    K = tip_compliance(coarsest_mesh, 1.1 * PETG[0], PETG[1], attached_to(stiffer)).K
    shares = np.log(np.divide(K, coarsest.K)) / np.log(1.1)
    expected = [clamp_share(leaf.length, give) for leaf, give in zip(LEAVES, GIVES, strict=True)]
    np.testing.assert_allclose(shares, expected, rtol=0.2)


@pytest.mark.slow
def test_glue_that_misses_the_last_millimetre_costs_what_the_bound_says(coarse, coarse_mesh):
    """A planted fault: the glue of the cells next to each shoulder is as soft as air, over about 1 mm."""
    glue = cells_of(coarse_mesh, GLUE)
    corners = coarse_mesh.p[0][coarse_mesh.t[:, glue]]
    loose = np.zeros(len(glue), dtype=bool)
    bound = []
    for arm, give in zip(STRIP_HOUSING.arms, GIVES, strict=True):
        for shoulder, sign in ((arm.wall, arm.sign), (arm.shuttle, -arm.sign)):
            near, far = (edge(sign * (corners - shoulder), axis=0) for edge in (np.min, np.max))
            in_slot = (near > -1e-9) & (far < CLAMP.length + 1e-9)
            missing = min(np.unique(far[in_slot].round(9)), key=lambda end: abs(end - 1.0))
            loose |= in_slot & (far < missing + 1e-6)
        bound.append(unbonded_loss(arm.flexure.length, give, missing))
    attached = (*attached_to(STRIP_HOUSING), Inset(name="loose", E=1e-3, poisson=0.0))
    found = tip_compliance(coarse_mesh.with_subdomains({"loose": glue[loose]}), *PETG, attached)
    np.testing.assert_allclose(1.0 - np.divide(found.K, coarse.K), bound, rtol=0.05)
    assert min(bound) > 0.2


def test_a_mesh_without_strips_is_refused(coarsest_mesh):
    bare = dataclasses.replace(coarsest_mesh, _subdomains=None)
    with pytest.raises(SolveError, match="strips"):
        clamped_half(bare, *PETG, insets(CLAMP))


def test_strips_weigh_what_steel_weighs(coarsest_mesh):
    half = clamped_half(coarsest_mesh, *PETG, attached_to(STRIP_HOUSING))
    steel = volume(coarsest_mesh, coarsest_mesh.subdomains[STRIP])
    whole = half.basis.dx.sum()
    wanted = whole + (CLAMP.strip_over_print_density - 1.0) * steel
    assert weight_load(half, PRESS).sum() == pytest.approx(wanted, rel=1e-9)


@pytest.mark.slow
def test_round_off_is_a_sixth_of_what_the_condition_number_says(coarse_mesh):
    """Entries of the matrix that are off by one bit move the tips by less than the limit allows."""
    half = clamped_half(coarse_mesh, *PETG, attached_to(STRIP_HOUSING))
    mean = tip_means(half.basis, PRESS)
    u = half.factor.solve(0.5 * mean)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], half.matrix.nnz)
    jittered = csc_matrix((half.matrix.data * (1.0 + EPSILON * signs), half.matrix.indices, half.matrix.indptr))
    other = factorise(csc_matrix(0.5 * (jittered + jittered.T)), half.factor.fixed, STRIP_DIGITS).solve(0.5 * mean)
    K, moved = tip_stiffnesses(mean.T @ u), tip_stiffnesses(mean.T @ other)
    assert max(abs(b / a - 1.0) for a, b in zip(K, moved, strict=True)) < STRIP_DIGITS / 6.0


@pytest.mark.study
def test_bar_holds_the_stiffness_of_a_mesh_of_twice_the_dofs(coarse):
    attached = attached_to(STRIP_HOUSING)
    fine = tip_compliance(flexure_mesh(STRIP_HOUSING, 1.0), *PETG, attached)
    found = stiffness_on(STRIP_PAIR, STRIP_HOUSING, fine, coarse)
    more = {"near": 10, "far": 6, "beside_slot": 6, "glue": 3, "root": 4, "along_leaf": 20, "leaf_end": 6}
    finer = dataclasses.replace(counts(STRIP_HOUSING, 1.0), **more)
    truth = tip_compliance(mesh_of_counts(STRIP_HOUSING, finer, 2), *PETG, attached)
    assert truth.dofs > 1.7 * fine.dofs
    for K, exact, bar in zip(found.K, truth.K, found.error, strict=True):
        assert abs(K / exact - 1.0) < bar < 1.5e-3
    strains = zip(found.strain_per_N, truth.strain_per_N, found.strain_error, strict=True)
    assert all(abs(strain / exact - 1.0) < bar for strain, exact, bar in strains)

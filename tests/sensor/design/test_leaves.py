import math

import numpy as np
import pytest

from pipeline.verdicts.hints import HINTS
from sensor.design.design_file import design_as_toml, design_from_mapping
from sensor.design.leaves import TARGET_SCATTER, beam_lengths, best_thickness, creep_of, leaves_of, stiffness_per_K
from sensor.design.parameters import Design, Print
from sensor.design.sheets import SHEETS
from sensor.quantity import InputError
from sensor.theory.leaf_spring import pair_length, root_strain
from sensor.theory.strip_clamp import clamp_share
from sensor.theory.two_spring_law import Springs

SHEET = SHEETS["spring-steel"]
SOFT = Springs(K_l=0.056, K_h=0.635)  # [N/mm], of mangoes


def strips(**keys):
    """Return a design with strips of steel, and tips as far apart as those of a pair."""
    return Design(print=Print(leaves="spring-steel", **keys))


def scatter(leaves, lengths):
    """Return two sigma of both stiffnesses as fractions."""
    sizes = [sizes for _, sizes in leaves.causes(lengths)]
    return [math.hypot(*of_spring) for of_spring in zip(*sizes, strict=True)]


def lengths_of(leaves):
    """Return the free lengths of leaves 10 mm deep by the beam law, with what their clamps give."""
    pairs = zip(leaves.thicknesses_mm, SOFT.stiffnesses, leaves.gives_mm, strict=True)
    return [t * math.cbrt(2.0 * SHEET.E_MPa * 10.0 / K) - 2.0 * give for t, K, give in pairs]


def next_of(thickness):
    """Return the next thicker sheet of the list [mm], twice the thickness where there is none."""
    return min((each for each in SHEET.thicknesses_mm if each > thickness), default=2.0 * thickness)


def test_printed_leaves_are_those_of_the_process_and_leave_no_trace_in_the_file():
    design = Design()
    leaves = leaves_of(design, SOFT)
    process = design.process
    assert leaves.is_printed
    assert (leaves.made_of.E_MPa, leaves.thicknesses_mm) == (process.E_MPa, process.leaf_thicknesses_mm)
    assert list(leaves.causes((20.0, 10.0))) == []
    assert "leaves" not in design_as_toml(design)  # the digest of a unit.toml is of this text


def test_strips_are_read_back_from_their_file():
    design = strips(leaf_thickness_low_mm=0.2, leaf_measured_low_mm=0.203, clamp_mm=4.0)
    data = {"print": {"leaves": "spring-steel", "leaf_thickness_low_mm": 0.2, "leaf_measured_low_mm": 0.203}}
    assert design_from_mapping({**data, "print": {**data["print"], "clamp_mm": 4.0}}) == design
    for key in ("leaves", "leaf_thickness_low_mm", "leaf_measured_low_mm", "clamp_mm"):
        assert f"{key} = " in design_as_toml(design)


def test_the_thinnest_sheet_that_is_known_well_enough_is_taken():
    """Weighed, K of the chosen strips scatters by less than 5 %, and that of the next thinner ones by more."""
    leaves = leaves_of(strips(), SOFT)
    listed = SHEET.thicknesses_mm
    weighed = leaves_of(
        strips(
            leaf_thickness_low_mm=leaves.sold_mm[0], leaf_measured_low_mm=leaves.sold_mm[0],
            leaf_thickness_high_mm=leaves.sold_mm[1], leaf_measured_high_mm=leaves.sold_mm[1],
        ),
        SOFT,
    )  # fmt: skip
    assert max(scatter(weighed, lengths_of(weighed))) <= TARGET_SCATTER
    assert min(scatter(leaves, lengths_of(leaves))) > TARGET_SCATTER  # as sold they are known to 4 and 3 % only
    for spring, chosen in zip(("low", "high"), leaves.sold_mm, strict=True):
        for thinner in listed[: listed.index(chosen)]:
            keys = {f"leaf_thickness_{spring}_mm": thinner, f"leaf_measured_{spring}_mm": thinner}
            worse = leaves_of(strips(**keys), SOFT)
            assert scatter(worse, lengths_of(worse))[spring == "high"] > TARGET_SCATTER


def test_leaves_that_are_not_made_have_the_lengths_of_the_beam_law():
    leaves = leaves_of(strips(), SOFT)
    assert beam_lengths(strips(), leaves, SOFT) == pytest.approx(lengths_of(leaves), rel=1e-9)


def test_thicker_strips_of_one_stiffness_strain_less():
    """L is proportional to t, and the strain 3 t d / L^2 to 1 / t: so the hint asks for a thicker sheet."""
    strains = []
    for thickness in (0.1, 0.2, 0.4):
        length = pair_length(SHEET.E_MPa, 10.0, thickness, 0.635)
        strains.append(root_strain(thickness, length, 1.0))
    assert strains == pytest.approx([strains[0], strains[0] / 2.0, strains[0] / 4.0])
    assert "thicker" in HINTS["geometry.stop_strain_high"]


@pytest.mark.parametrize("process", ["fdm-petg", "fdm-pla", "sls-pa12", "sla-resin"])
def test_no_sheet_tires_at_the_narrowest_stop_that_is_known_well_enough(process):
    """A stop is no nearer than the least gap. Both scatter and strain fall with thickness, and scatter asks for more.

    Where no sheet is known well enough, the thickest that the clamps hold is taken, which strains least.
    """
    design = strips(process=process)
    for K in np.geomspace(0.05, 60.0, 60).tolist():
        thickness = best_thickness(design, SHEET, K)
        keys = {"leaf_thickness_high_mm": thickness, "leaf_measured_high_mm": thickness}
        springs = Springs(K_l=0.05, K_h=K)
        leaves = leaves_of(strips(process=process, **keys), springs)
        lengths = beam_lengths(design, leaves, springs)
        strain = leaves.strain_factor * root_strain(thickness, lengths[1], design.process.min_gap_mm)
        is_thickest = not leaves.clamp.holds(
            leaves.clamp.give(next_of(thickness), design.process.E_MPa, design.process.poisson)
        )
        assert strain <= SHEET.strain_limit or is_thickest
        assert scatter(leaves, lengths)[1] <= TARGET_SCATTER or is_thickest


def test_a_measured_thickness_replaces_the_one_it_was_sold_as():
    keys = {"leaf_thickness_low_mm": 0.2, "leaf_measured_low_mm": 0.203, "leaf_thickness_high_mm": 0.3}
    leaves = leaves_of(strips(**keys), SOFT)
    assert leaves.thicknesses_mm == (0.203, 0.3)
    assert leaves.sold_mm == (0.2, 0.3)
    assert leaves.accuracies_mm == pytest.approx((SHEET.weighed * 0.203, SHEET.tolerance(0.3)))


def test_strips_of_one_sheet_are_off_alike_and_those_of_two_are_not():
    one = leaves_of(strips(leaf_thickness_low_mm=0.2, leaf_thickness_high_mm=0.2), SOFT)
    two = leaves_of(strips(leaf_thickness_low_mm=0.2, leaf_thickness_high_mm=0.25), SOFT)
    assert dict(one.causes(lengths_of(one)))["sheet thickness"] == pytest.approx((0.12, 0.12))
    apart = dict(two.causes(lengths_of(two)))
    assert apart["low sheet thickness"] == pytest.approx((0.12, 0.0))
    assert apart["high sheet thickness"] == pytest.approx((0.0, 3.0 * 0.009 / 0.25))


def test_springs_of_steel_hardly_feel_the_temperature():
    design = strips()
    leaves = leaves_of(design, SOFT)
    found = stiffness_per_K(leaves, design.process, lengths_of(leaves))
    assert abs(SHEET.E_per_K) < abs(found) < 2.0 * abs(SHEET.E_per_K) < 0.2 * abs(design.process.E_per_K)
    printed = leaves_of(Design(), SOFT)
    assert stiffness_per_K(printed, design.process, (20.0, 10.0)) == design.process.E_per_K


@pytest.mark.parametrize(
    ("keys", "field", "bound"),
    [
        ({"leaf_thickness_low_mm": 0.12}, "print.leaf_thickness_low_mm", "0.1, 0.15, 0.2"),
        ({"leaf_thickness_high_mm": 0.2, "leaf_measured_high_mm": 0.25}, "print.leaf_measured_high_mm", "0.016 mm"),
        ({"leaf_measured_low_mm": 0.1}, "print.leaf_thickness_low_mm", "given with"),
        ({"clamp_mm": 1.0}, "print.clamp_mm", "at least 2 mm"),
        ({"clamp_mm": 7.0}, "print.clamp_mm", "at most 6.4 mm"),
        ({"gauges": "foil"}, "print.gauges", "'none'"),
        ({"process": "dmls-ti64"}, "print.leaves", "'printed'"),
        ({"leaves": "printed", "clamp_mm": 4.0}, "print.clamp_mm", "left out"),
    ],
)
def test_strips_that_cannot_be_are_refused(keys, field, bound):
    with pytest.raises(InputError) as refused:
        Design(print=Print(**{"leaves": "spring-steel", **keys}))
    assert refused.value.field == field
    assert bound in str(refused.value)


def test_the_nearest_sheet_is_named():
    with pytest.raises(InputError, match=r"nearest, 0.3 mm"):
        strips(leaf_thickness_high_mm=0.31)


def test_springs_that_no_strip_has_are_refused():
    with pytest.raises(InputError) as refused:
        leaves_of(strips(), Springs(K_l=0.056, K_h=1e4))
    assert refused.value.field == "print.leaves"


def test_strips_creep_by_what_clamps_them_only():
    """A print of 5 % a decade makes strips, some 3 % of whose compliance lies in the clamps, creep by 0.15 %."""
    design = strips()
    leaves = leaves_of(design, SOFT)
    process = design.process
    assert creep_of(leaves_of(Design(), SOFT), process, (20.0, 10.0)) == process.creep
    lengths = lengths_of(leaves)
    shares = [clamp_share(length, give) for length, give in zip(lengths, leaves.gives_mm, strict=True)]
    found = creep_of(leaves, process, lengths)
    assert found.per_decade == pytest.approx(0.5 * sum(shares) * process.creep.per_decade)
    assert 0.5 * (max(shares) - min(shares)) * process.creep.per_decade <= found.error < 0.1 * process.creep.per_decade

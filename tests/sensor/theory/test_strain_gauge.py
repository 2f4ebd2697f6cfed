"""Foil gauges: data with sources, room on a leaf, and the beam with skins against limits and quadrature."""

from dataclasses import replace

import numpy as np
import pytest

from sensor.design.parameters import Design, Print
from sensor.design.printability import check_printable
from sensor.design.processes import PROCESSES
from sensor.quantity import InputError
from sensor.theory.leaf_spring import Flexure, LeafProfile, pair_stiffness
from sensor.theory.strain_gauge import FOIL, GaugeSpans, gauge_spans, gauged_length, sandwich_gain, shortest_gauged
from sensor.theory.two_spring_law import Springs

LEAF = Flexure(thickness=0.8, length=28.0, depth=10.0, separation=14.0, fillet=0.5)
SECTION = (10.0, 0.8)
PROFILE = LeafProfile(*SECTION, fillet=0.5)
PETG = PROCESSES["fdm-petg"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"backing_length_mm": 3.9}, "gauge foil.backing_length_mm"),
        ({"backing_width_mm": 3.0}, "gauge foil.backing_width_mm"),
        ({"foil_fill": 1.1}, "gauge foil.foil_fill"),
    ],
)
def test_gauge_that_cannot_be_is_refused(change, field):
    with pytest.raises(InputError) as error:
        replace(FOIL, **change)
    assert error.value.field == field


def test_gauges_lie_mirrored_between_the_fillets_grid_towards_the_root():
    wall, shuttle = gauge_spans(LEAF, FOIL)
    assert wall == GaugeSpans(backing=(0.5, 6.5), metal=(1.0, 6.0), grid=(1.0, 4.0))
    assert shuttle == GaugeSpans(backing=(27.5, 21.5), metal=(27.0, 22.0), grid=(27.0, 24.0))


def test_shortest_leaf_is_the_shortest_that_has_room():
    least = shortest_gauged(0.5, FOIL)
    assert gauge_spans(replace(LEAF, length=least), FOIL)[0].backing[1] == pytest.approx(0.5 * least)
    with pytest.raises(InputError) as error:
        gauge_spans(replace(LEAF, length=least - 0.1), FOIL)
    assert error.value.field == "flexure.length"
    with pytest.raises(InputError) as error:
        gauge_spans(replace(LEAF, depth=3.0), FOIL)
    assert error.value.field == "flexure.depth"


def test_gain_is_that_of_the_integral_of_moment_squared_over_stiffness():
    """Castigliano on a fine grid: d = F int (s - L/2)^2 / EI ds for a leaf that is symmetric about its middle."""
    E, (w, t), L = 3300.0, SECTION, 30.0
    s = (np.arange(200000) + 0.5) * L / 200000
    from_end = np.minimum(s, L - s)
    EI = np.full_like(s, E * w * t**3 / 12.0)
    EI += 0.5 * t**2 * 4.0 * 2500.0 * 0.075 * ((from_end > 0.5) & (from_end < 6.5))
    EI += 0.5 * t**2 * 3.0 * 162000.0 * 0.005 * 0.6 * ((from_end > 1.0) & (from_end < 6.0))
    leaf = 1.0 / float(((s - L / 2) ** 2 / EI).mean() * L)
    bare = 0.5 * pair_stiffness(E, w, t, L)
    assert sandwich_gain(E, PROFILE, L, FOIL) == pytest.approx(0.5 * (1.0 + leaf / bare), rel=1e-4)


@pytest.mark.parametrize(("E", "K"), [(2000.0, 0.906), (110000.0, 0.906), (2000.0, 20.8)])
def test_length_for_a_stiffness_has_that_stiffness(E, K):
    length = gauged_length(E, PROFILE, K, FOIL)
    assert pair_stiffness(E, *SECTION, length) * sandwich_gain(E, PROFILE, length, FOIL) == pytest.approx(K)


def test_printable_lengths_have_the_gauges_on():
    springs = Springs(K_l=0.906, K_h=20.83)
    bare = check_printable(Design(), springs, 4.63)
    fitted = check_printable(Design(print=Print(gauges="foil")), springs, 4.63)
    for one, two, t, K in zip(bare, fitted, (0.8, 1.2), springs.stiffnesses, strict=True):
        leaf = LeafProfile(depth=10.0, thickness=t, fillet=0.5)
        assert one.length_mm < two.length_mm == gauged_length(2000.0, leaf, K, FOIL)
        assert (one.shortest_mm, two.shortest_mm) == (5.0 * t, 13.0)
        assert two.passed is True
        gain = sandwich_gain(2000.0, leaf, two.length_mm, FOIL)
        strain = one.root_strain * (one.length_mm / two.length_mm) ** 2 * (2.0 * gain - 1.0)
        assert two.root_strain == pytest.approx(strain)


def test_leaf_without_room_for_its_gauges_fails_and_says_so():
    _, high = check_printable(Design(print=Print(gauges="foil")), Springs(K_l=0.906, K_h=60.0), 4.63)
    assert high.passed is False
    assert "must be at least room for a gauge at each root = 13 mm" in high.reason
    _, high = check_printable(Design(), Springs(K_l=0.906, K_h=60.0), 4.63)
    assert high.passed is not False
    shallow = replace(PETG, name="own", depth_mm=3.0)
    design = Design(print=Print(process="own", gauges="foil"), printer=shallow)
    low, _ = check_printable(design, Springs(K_l=0.3, K_h=3.0), 1.0)
    assert "a leaf 3 mm deep, must be at least the gauge of 4 mm" in low.reason

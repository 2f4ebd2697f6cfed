"""Curves of a flat punch at large strain, as stored: against an independent program, closed forms, and our table.

The independent program has other elements (quadratic, integrated in full), another mesh and its own contact; it states
0.2 to 0.4 %. Its forces are over the linear ones of a sharp tip that slides; its tips grip.
"""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from reference.stored import stored
from sensor.theory.soft_tissue import FLESH_LAWS, no_slip

TABLE = tomllib.loads(
    (Path(__file__).parents[3] / "sensor" / "theory" / "large_strain.toml").read_text(encoding="utf-8")
)
CURVES = {(curve["law"], curve["poisson"], curve["edge"]): curve for curve in stored("flat_punch")}
RADIUS = 1.0 / math.sqrt(math.pi)  # of the circle with the area of a square tip [tip sides]
DECIMALS = 6e-5  # of which four are written
STATED = 0.004  # error of the independent program
SHARP = {  # by depth, at nu; by mixed elements at 0.49 from 0.2 on
    0.30: [1.0297, 1.0277, 1.0238, 1.0214, 1.0223, 1.0247, 1.0277, 1.0316],
    0.40: [1.0096, 1.0045, 0.9982, 0.9910, 0.9867, 0.9832, 0.9811, 0.9799],
    0.45: [1.0027, 0.9964, 0.9894, 0.9798, 0.9723, 0.9659, 0.9609, 0.9547],
    0.49: [1.0001, 0.9938, 0.9872, 0.975, 0.964, 0.956, 0.947, 0.939],
}
ROUNDED = {  # at first touch, and at depths of 0.1, 0.3 and 0.6, at nu and an edge
    (0.30, 0.05): (0.9087, [0.9722, 1.0043, 1.0296]),
    (0.30, 0.10): (0.8178, [0.9047, 0.9645, 1.0091]),
    (0.45, 0.05): (0.9090, [0.9385, 0.9498, 0.9482]),
    (0.45, 0.10): (0.8178, [0.8735, 0.9106, 0.9248]),
}
OTHER_LAWS = {  # over the force at first touch, at depths of 0.1, 0.3 and 0.6
    ("hencky", 0.30): [1.024, 1.072, 1.128],
    ("foam", 0.30): [0.977, 0.953, 0.953],
    ("hencky", 0.49): [1.001, 1.002, 0.991],
    ("foam", 0.49): [0.981, 0.954, 0.950],
}


def curve_at(depths, law, poisson, edge=0.0):
    """Return the factors and their errors [1] of a curve at depths [tip sides], before its first as there."""
    curve = CURVES[law, poisson, edge]
    factors = PchipInterpolator(curve["depths"], curve["factors"])(np.maximum(depths, curve["depths"][0]))
    return factors, np.interp(depths, curve["depths"], curve["errors"])


def assert_agree(found, expected):
    """Assert that factors agree within their errors and those of the independent program."""
    factors, errors = found
    np.testing.assert_array_less(np.abs(factors - expected), errors + STATED)


@pytest.mark.parametrize("law", FLESH_LAWS)
@pytest.mark.parametrize("poisson", TABLE["poissons"])
def test_table_holds_what_was_found(law, poisson):
    reached = CURVES[law, poisson, 0.0]["depths"][-1]
    depths = [depth for depth in TABLE["depths"] if depth <= reached * (1.0 + 1e-9)]
    row = TABLE["poissons"].index(poisson)
    written = [TABLE[what][law]["rows"][row] for what in ("factors", "errors")]
    for found, numbers in zip(curve_at(depths, law, poisson), written, strict=True):
        assert found == pytest.approx(numbers, abs=DECIMALS)


@pytest.mark.parametrize("poisson", SHARP)
def test_sharp_tips_are_those_of_the_independent_program(poisson):
    grip = CURVES["neo-hooke", poisson, 0.0]["grip"]
    depths = [0.002, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert_agree([grip * found for found in curve_at(depths, "neo-hooke", poisson)], SHARP[poisson])


@pytest.mark.parametrize(("poisson", "edge"), ROUNDED)
def test_rounded_edges_are_too(poisson, edge):
    grip = CURVES["neo-hooke", poisson, edge]["grip"]
    first, expected = ROUNDED[poisson, edge]
    assert_agree([grip * found for found in curve_at([0.1, 0.3, 0.6], "neo-hooke", poisson, edge)], expected)
    # In the first step of that program nothing grips yet; here the sharp tip beside it grips too.
    assert_agree(curve_at([0.002], "neo-hooke", poisson, edge), first)


@pytest.mark.parametrize(("law", "poisson"), OTHER_LAWS)
def test_other_laws_are_too(law, poisson):
    assert_agree(curve_at([0.1, 0.3, 0.6], law, poisson), OTHER_LAWS[law, poisson])


@pytest.mark.parametrize("layer", stored("punch_on_a_layer"), ids=lambda layer: layer["radius_over_height"])
def test_small_strain_is_that_of_a_punch_on_a_bonded_layer(layer):
    """F = kappa 2 r E d / (1 - nu^2) with kappa of W. C. Hayes et al., 1972, at nu = 0.3; known to 0.002."""
    published = {0.2: 1.207, 0.4: 1.473, 1.0: 2.484}[layer["radius_over_height"]]
    coarse, fine = layer["sliding"]
    step = coarse - fine
    halfspace = 2.0 * RADIUS / (1.0 - 0.3**2)
    # A singular edge converges with the size of its elements: as much again as the last step is left.
    assert (fine - step) / halfspace == pytest.approx(published, abs=0.002 + 0.5 * step / halfspace)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_grip_at_small_strain_is_that_of_spence(poisson):
    """On a half-space, which the body is but for 4 % of its force: of the grip too."""
    assert CURVES["neo-hooke", poisson, 0.0]["grip"] - 1.0 == pytest.approx(no_slip(poisson), rel=0.06)

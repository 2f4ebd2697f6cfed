"""Curves of a flat punch at large strain, as stored: against our table, and against closed forms at small strain.

An independent program with other elements (quadratic, integrated in full), another mesh and its own contact finds them
too, and states 0.2 to 0.4 %. `tests/sensor/theory/test_soft_tissue.py` compares the table with its forces.
"""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from reference.stored import stored
from sensor.theory.soft_tissue import FLESH_LAWS, no_slip_stiffness_change

TABLE = tomllib.loads(
    (Path(__file__).parents[3] / "sensor" / "theory" / "large_strain.toml").read_text(encoding="utf-8")
)
CURVES = {(curve["law"], curve["poisson"], curve["edge"]): curve for curve in stored("flat_punch")}
RADIUS = 1.0 / math.sqrt(math.pi)  # of the circle with the area of a square tip [tip sides]
DECIMALS = 6e-5  # of which four are written


@pytest.mark.parametrize("law", FLESH_LAWS)
@pytest.mark.parametrize("poisson", TABLE["poissons"])
def test_table_holds_what_was_found(law, poisson):
    curve = CURVES[law, poisson, 0.0]
    row = TABLE["poissons"].index(poisson)
    depths = TABLE["depths"][: len(TABLE["factors"][law]["rows"][row])]
    assert len(depths) == sum(depth <= curve["depths"][-1] * (1.0 + 1e-9) for depth in TABLE["depths"])
    expected = PchipInterpolator(curve["depths"], curve["factors"])(depths)
    assert TABLE["factors"][law]["rows"][row] == pytest.approx(expected, abs=DECIMALS)
    errors = np.interp(depths, curve["depths"], curve["errors"])
    assert TABLE["errors"][law]["rows"][row] == pytest.approx(errors, abs=DECIMALS)


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
    assert CURVES["neo-hooke", poisson, 0.0]["grip"] - 1.0 == pytest.approx(no_slip_stiffness_change(poisson), rel=0.06)

"""What the linear law reads from deep tips, against an independent program and against a root of the balance."""

import pytest

from reference.deep_press import DeepPress
from sensor.theory.two_spring_law import Springs

SPRINGS = Springs(K_l=0.906, K_h=20.83)
TRAVELS = (0.1, 0.3, 0.6)
# Stiffness of the block of 20 x 20 x 12 mm under a square of 1 mm over E, by three-dimensional elements [mm].
K_M_OVER_E = {0.3: 1.3226, 0.45: 1.505, 0.49: 1.579}
BIASES = {  # per cent, of E = 1 MPa, by an independent program whose forces are known to 0.4 %
    ("neo-hooke", 0.30): (-0.9, -0.9, 0.7),
    ("neo-hooke", 0.45): (-1.8, -3.9, -5.9),
    ("neo-hooke", 0.49): (-1.7, -4.4, -7.0),
    ("hencky", 0.30): (3.4, 9.8, 17.6),
    ("foam", 0.30): (-3.3, -6.2, -5.4),
}


@pytest.mark.parametrize(("law", "poisson"), BIASES)
def test_bias_of_the_linear_law_is_that_of_the_independent_program(law, poisson):
    press = DeepPress(springs=SPRINGS, side=1.0, poisson=poisson, law=law)
    found = [100.0 * press.bias(K_M_OVER_E[poisson], travel) for travel in TRAVELS]
    # E answers P about 1.4 times, and both programs' forces are known to 0.4 % and their start too.
    assert found == pytest.approx(BIASES[law, poisson], abs=1.4 * 2.0 * 0.4)

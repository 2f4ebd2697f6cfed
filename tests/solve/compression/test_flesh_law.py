import numpy as np
import pytest

from sensor.quantity import InputError
from sensor.theory.soft_tissue import FLESH_LAWS
from solve.compression.flesh_law import FleshLaw
from solve.elasticity import lame_parameters

POISSONS = (0.0, 0.3, 0.49)


def energy(law, stretches):
    """Return W at principal stretches (..., 3)."""
    return law.phi(stretches)[0].sum(axis=-1) + law.U(np.log(stretches.prod(axis=-1)))[0]


@pytest.mark.parametrize("poisson", POISSONS)
@pytest.mark.parametrize("name", FLESH_LAWS)
def test_small_strain_is_that_of_hooke(name, poisson):
    law, strains = FleshLaw(name=name, poisson=poisson), np.array([0.7, -0.4, 0.2])
    lam, mu = lame_parameters(1.0, poisson)
    hooke = mu * (strains**2).sum() + 0.5 * lam * strains.sum() ** 2
    step = 1e-3  # the third derivative leaves a share of this size; opposite strains cancel it
    W = 0.5 * sum(energy(law, 1.0 + sign * step * strains) for sign in (1.0, -1.0)) / step**2
    no_strain = energy(law, np.ones(3)) / step**2
    assert W - no_strain == pytest.approx(hooke, rel=100.0 * step**2 * lam if lam > 1.0 else 100.0 * step**2)


@pytest.mark.parametrize("poisson", [-0.1, 0.495, 0.5, float("nan")])
def test_poisson_beyond_what_was_measured_is_refused(poisson):
    with pytest.raises(InputError) as refused:
        FleshLaw(poisson=poisson)
    assert refused.value.field == "fruit.poisson"

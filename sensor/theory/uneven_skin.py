"""The displacement of a dome by the waves of an uneven skin, as a function of the radius of its contact.

To first order, small heights h(x, y) of the skin change the force F of a dome at a given approach by the mean of h over
the contact, weighted by the pressure of the flat punch of its radius a:

    dF = dF/d(approach) * integral of h p_0,    p_0 = 1 / (2 pi a sqrt(a^2 - r^2)),    integral of p_0 = 1.

This follows from Betti's theorem of reciprocity, applied to the pressure that h adds and to a flat punch at unit depth.
The edge of the contact moves too, but the pressure there is 0. The punch is K. L. Johnson, Contact Mechanics (1985),
equations (3.34) and (3.36), doi:10.1017/CBO9781139171731. A wave A cos(k . X) with X from the middle of the contact has
the mean A sin(k a) / (k a).

So the effective height under a dome changes while its contact grows. A constant height would be an offset, which does
not affect a press; a changing height is mistaken for a rise. Short waves average out, but only once the contact is
wide.

If the contact is not much wider than a wave, it has several parts, and the law gives only the order of magnitude: see
tests/reference/fits/test_uneven_skin.py. Units: mm.
"""

import numpy as np

from sensor.arrays import Floats

WAVES = 9  # Gauss points over the logarithm of the wave length; twice as many change less than 0.1 %


def wave_numbers(shortest: float, longest: float) -> tuple[Floats, Floats]:
    """Return wave numbers k [1/mm] between two wave lengths [mm], and their shares of the mean square height [1].

    The shares are uniform over the logarithm of the wave length.
    """
    nodes, weights = np.polynomial.legendre.leggauss(WAVES)
    lengths = np.sqrt(shortest * longest) * np.exp(0.5 * np.log(longest / shortest) * nodes)
    return 2.0 * np.pi / lengths, 0.5 * weights


def effective_heights(wave_number: float, contact_radius: Floats) -> Floats:
    """Return the effective height under a dome, over the height of a wave [1/mm] at the middle of its contact [1].

    `contact_radius` [mm] may have any shape.
    """
    return np.asarray(np.sinc(wave_number * contact_radius / np.pi))


def correlations(wave_number: float, apart: Floats) -> Floats:
    """Return the correlation J0 [1] of the heights at places at these distances [mm], for waves in all directions."""
    from scipy.special import j0  # seldom needed, and slow to load

    return np.asarray(j0(wave_number * apart))

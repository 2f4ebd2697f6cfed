"""How far the waves of an uneven skin push back a dome whose contact has grown to a radius.

To first order, small heights h(x, y) of the skin change the force F of a dome at a given approach by the mean of h over
the contact, weighted by the pressure of the flat punch of its radius a:

    dF = dF/d(approach) * integral of h p_0,    p_0 = 1 / (2 pi a sqrt(a^2 - r^2)),    integral of p_0 = 1.

This is Betti's theorem of reciprocity between the pressure that h adds and the flat punch that sinks by a unit. The
edge of the contact moves too, but the pressure there is 0. The punch is that of K. L. Johnson, Contact Mechanics
(1985), equations (3.34) and (3.36), doi:10.1017/CBO9781139171731. A wave A cos(k . X) with X from the middle of the
contact has the mean A sin(k a) / (k a).

So a dome stands on a height that changes while its contact grows. A constant height would be an offset, which a press
does not see; a change of height is taken for a rise. Short waves average out, but only after the contact is wide.

Where the contact is not much wider than a wave, it has several parts, and the law is one of size only: see
tests/reference/fits/test_uneven_skin.py. mm.
"""

import numpy as np

from sensor.arrays import Floats

WAVES = 9  # Gauss points over the logarithm of the wave length: twice as many change no tenth of a per cent


def wave_numbers(shortest: float, longest: float) -> tuple[Floats, Floats]:
    """Return wave numbers k [1/mm] between two wave lengths [mm], and their shares of the square of the heights [1].

    The shares are even over the logarithm of the wave length.
    """
    nodes, weights = np.polynomial.legendre.leggauss(WAVES)
    lengths = np.sqrt(shortest * longest) * np.exp(0.5 * np.log(longest / shortest) * nodes)
    return 2.0 * np.pi / lengths, 0.5 * weights


def felt_heights(wave_number: float, contact_radius: Floats) -> Floats:
    """Return the height on which a dome stands [1], over that of a wave [1/mm] at the middle of its contact.

    `contact_radius` [mm] may have any shape.
    """
    return np.asarray(np.sinc(wave_number * contact_radius / np.pi))


def correlations(wave_number: float, apart: Floats) -> Floats:
    """Return the correlation [1] of the heights of waves of any direction at places some distances apart [mm]: J0."""
    from scipy.special import j0  # seldom needed, and slow to load

    return np.asarray(j0(wave_number * apart))

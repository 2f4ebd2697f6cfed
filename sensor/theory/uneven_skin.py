"""The displacement of a dome by the waves of an uneven skin, as a function of the contact radius.

Small heights h(x, y) of the skin change the force F of a dome at a given approach. To first order, the change is
proportional to a weighted mean of h over the contact. The weight is the pressure p_0 of a flat punch with the contact
radius a:

    dF = dF/d(approach) * integral of h p_0,    p_0 = 1 / (2 pi a sqrt(a^2 - r^2)),    integral of p_0 = 1.

This follows from Betti's reciprocal theorem, applied to the pressure that h adds and to a flat punch at unit depth. The
edge of the contact moves too, but the pressure there is 0. For the punch see K. L. Johnson, Contact Mechanics (1985),
equations (3.34) and (3.36), doi:10.1017/CBO9781139171731. A wave A cos(k . X), with X measured from the centre of the
contact, has the mean A sin(k a) / (k a).

So the effective height under a dome changes while its contact grows. A constant height would be an offset, which does
not affect a press, but a changing height is mistaken for a rise of the contrast. Short waves average out only after the
contact has become wide.

If the contact is not much wider than a wavelength, it splits into several parts. The law then gives only the order of
magnitude: see tests/reference/fits/test_uneven_skin.py. Units: mm.
"""

import numpy as np

from sensor.arrays import Floats

WAVES = 9  # Gauss points over the logarithm of the wavelength; doubling them changes the results by less than 0.1 %


def wave_numbers(shortest: float, longest: float) -> tuple[Floats, Floats]:
    """Return wave numbers k [1/mm] between two wavelengths [mm], and the share of each in the mean square height [1].

    The mean square height is distributed uniformly over the logarithm of the wavelength.
    """
    nodes, weights = np.polynomial.legendre.leggauss(WAVES)
    lengths = np.sqrt(shortest * longest) * np.exp(0.5 * np.log(longest / shortest) * nodes)
    return 2.0 * np.pi / lengths, 0.5 * weights


def effective_heights(wave_number: float, contact_radius: Floats) -> Floats:
    """Return the effective height under a dome, divided by the height of the wave at the centre of the contact [1].

    `wave_number` is in [1/mm], and `contact_radius` [mm] may have any shape.
    """
    return np.asarray(np.sinc(wave_number * contact_radius / np.pi))


def correlations(wave_number: float, apart: Floats) -> Floats:
    """Return the correlation J0 [1] of the heights of points `apart` [mm], for waves in all directions."""
    from scipy.special import j0  # rarely needed, and slow to import

    return np.asarray(j0(wave_number * apart))

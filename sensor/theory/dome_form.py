"""The effect of a flattened or pointed apex on the displacement of a dome, as a function of the contact radius.

The printed apex of a dome is flat or pointed. The deviation from the sphere is modelled as a cap of the height

    h(r) = c (1 - (r / b)^2)^2 within the radius b, and 0 beyond.

To first order, its effect is the mean of h, weighted by the pressure of a flat punch with the contact radius a. The
heights of an uneven skin obey the same law (`uneven_skin.py`). With s = a / b and u = sqrt(1 - (r / a)^2) the mean is

    c int_(u_edge)^1 (1 - s^2 + s^2 u^2)^2 du.

The edge of the cap, r = b, is at u_edge = sqrt(1 - 1 / s^2). If s < 1, the cap extends beyond the contact, and u_edge
is 0.

The cap of a dome is the same in every press, so its error is a systematic error of the unit. Units: mm.
"""

import numpy as np

from sensor.arrays import Floats


def effective_cap_height(cap_radius: float, contact_radius: Floats) -> Floats:
    """Return the effective height of a cap, divided by its height at the apex [1], for each contact radius [mm]."""
    s_squared = np.square(contact_radius / cap_radius)
    u_edge = np.sqrt(np.maximum(1.0 - 1.0 / np.maximum(s_squared, 1.0), 0.0))
    constant = 1.0 - s_squared
    # integrals of the three terms of (constant + s^2 u^2)^2
    first = constant**2 * (1.0 - u_edge)
    second = 2.0 * constant * s_squared * (1.0 - u_edge**3) / 3.0
    third = s_squared**2 * (1.0 - u_edge**5) / 5.0
    return np.asarray(first + second + third)

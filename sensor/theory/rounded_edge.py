"""A flat tip with a rounded edge: its loss of force compared with a sharp tip, at any depth.

The tip is modelled as a round tip of the same width. Its profile is a flat face of radius a, followed by a quarter
circle with the radius of the edge. I. N. Sneddon, Int. J. Eng. Sci. 3, 1965, doi 10.1016/0020-7225(65)90019-4, gives
the depth and the force of any round tip on a half-space. From a depth of 0.02 sides on, the loss of square tips in
unilateral contact is the same within 0.003.
"""

import functools

import numpy as np

from sensor.arrays import Floats

_CURVE_STEPS = 40  # number of steps of the curve of force loss against depth
# largest sine of the edge angle in contact; at the side wall, where it is 1, the depth tends to infinity
_LARGEST_SINE = 0.999
_POINTS = 48  # points per integral by the midpoint rule; the relative error of the loss is 1e-4
_MIDPOINTS = (np.arange(_POINTS) + 0.5) / _POINTS


def edge_loss(depth: Floats | float, side: float, radius: float) -> Floats:
    """Return the relative loss of force [1] caused by a rounded edge, compared with a sharp tip at the same depth.

    `depth`, an array of any shape, the `side` of the tip and the `radius` of its edge are in mm. The loss is
    2 radius / side at first contact and decreases with depth; it is 0 for a sharp edge. The radius is at most side / 2.
    """
    relative_depth = np.asarray(2.0 / side * depth, dtype=np.float64)  # [half sides]
    if radius <= 0.0:
        return np.zeros_like(relative_depth)
    depths, losses = _loss_curve(min(1.0, 2.0 * radius / side))
    # At depth 0, where loss / depth is 0 / 0, its value at the first point of the curve with a depth above 0 is used.
    loss_at_touch = np.full_like(relative_depth, losses[1] / depths[1])
    loss = np.interp(relative_depth, depths, losses)
    return np.divide(loss, relative_depth, out=loss_at_touch, where=relative_depth > 0.0)


@functools.lru_cache(maxsize=32)
def _loss_curve(edge_radius: float) -> tuple[Floats, Floats]:
    """Return depths [half sides], increasing from 0, and the loss of force at each depth.

    The loss is in units of the force of a sharp tip at a depth of half a side. Both arrays begin with 0, at first
    contact. `edge_radius` is in half sides. The results are cached, because a run uses the same curve repeatedly.
    """
    # Sines of the edge angle up to which the edge is in contact. The contact radius is
    # 1 - edge_radius + edge_radius * sine.
    sines = _LARGEST_SINE * np.arange(_CURVE_STEPS + 1) / _CURVE_STEPS
    steps = np.diff(sines)
    midpoints = sines[:-1, None] + steps[:, None] * _MIDPOINTS
    depth_integrals = np.cumsum(edge_radius * steps * _depth_of_contact(edge_radius, midpoints).mean(axis=1))
    depths = _depth_of_contact(edge_radius, sines[1:])
    # The flat face has the radius a, and the contact the radius b. The force is 2 E* (depth b - integral of the depth
    # from a to b). Forces are divided by 2 E* here, so that the force of a sharp tip, with b = 1, equals its depth.
    losses = edge_radius * (1.0 - sines[1:]) * depths + depth_integrals
    return np.append(0.0, depths), np.append(0.0, losses)


def _depth_of_contact(edge_radius: float, sine: Floats) -> Floats:
    """Return the depth [half sides] at which the contact extends up to the edge angle with this sine.

    `edge_radius` is in half sides, and `sine` has any shape. Let t be the radius of the contact, and g
    the profile of the tip. By Sneddon, the depth is t times the integral of g' / sqrt(t^2 - r^2) over the radius r.
    """
    angle = np.arcsin(sine)
    t = 1.0 - edge_radius + edge_radius * sine
    # angles within the edge; the square removes the singularity at r = t
    angles = angle[..., None] * (1.0 - _MIDPOINTS**2)
    r = 1.0 - edge_radius + edge_radius * np.sin(angles)
    integrand = 2.0 * _MIDPOINTS * np.sin(angles) / np.sqrt(t[..., None] ** 2 - r**2)
    return np.asarray(t * edge_radius * angle * integrand.mean(axis=-1))

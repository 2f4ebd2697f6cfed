"""A flat tip with a rounded edge: its loss of force against a sharp tip, at any depth.

The tip is modelled as a round one of the same width: a flat face of radius a, then a quarter circle with the radius of
the edge. I. N. Sneddon, Int. J. Eng. Sci. 3, 1965, doi 10.1016/0020-7225(65)90019-4, gives depth and force of any round
tip on a half-space. Unilateral contact of square tips has the same loss within 0.003, from a depth of 0.02 sides on.
"""

import functools

import numpy as np

from sensor.arrays import Floats

_CURVE = 40  # steps of the curve of force over depth
_WIDEST = 0.999  # largest contact over the edge's radius; the depth tends to infinity at the side wall
_POINTS = 48  # points per integral by the midpoint rule, for an error of 1e-4 of the loss
_MIDPOINTS = (np.arange(_POINTS) + 0.5) / _POINTS


def edge_loss(depth: Floats | float, side: float, radius: float) -> Floats:
    """Return the relative loss of force [1] that a rounded edge causes, compared with a sharp tip at the same depth.

    `depth`, an array of any shape, the `side` of the tip and the `radius` of its edge are in mm. The loss is 2 radius /
    side at first touch and decreases with depth; it is 0 for a sharp edge. The radius is at most side / 2.
    """
    relative_depth = np.asarray(2.0 / side * depth, dtype=np.float64)
    if radius <= 0.0:
        return np.zeros_like(relative_depth)
    depths, losses = _loss_curve(min(1.0, 2.0 * radius / side))
    loss_at_touch = np.full_like(relative_depth, losses[1] / depths[1])
    loss = np.interp(relative_depth, depths, losses)
    return np.divide(loss, relative_depth, out=loss_at_touch, where=relative_depth > 0.0)


@functools.lru_cache(maxsize=32)
def _loss_curve(edge: float) -> tuple[Floats, Floats]:
    """Return depths [half sides], from 0 up, and the loss of force at each, in units of the force at a depth of 1.

    `edge` is the radius of the edge [half sides]. A sharp tip has a force in proportion to its depth.
    """
    contact = _WIDEST * np.arange(_CURVE + 1) / _CURVE  # sine of the angle of the edge up to which it touches
    steps = np.diff(contact)
    midpoints = contact[:-1, None] + steps[:, None] * _MIDPOINTS
    depth_integrals = np.cumsum(edge * steps * _depth_of_contact(edge, midpoints).mean(axis=1))
    depths = _depth_of_contact(edge, contact[1:])
    # The force 2 E* (depth b - integral of the depth from a to b) is divided by 2 E*; a sharp tip has the depth itself.
    losses = edge * (1.0 - contact[1:]) * depths + depth_integrals
    return np.append(0.0, depths), np.append(0.0, losses)


def _depth_of_contact(edge: float, sine: Floats) -> Floats:
    """Return the depth [half sides] at which the contact reaches an angle of the edge, given by its sine.

    By Sneddon it is t times the integral of g' / sqrt(t^2 - r^2) over the radius r, with t the radius of the contact
    and g the profile of the tip.
    """
    angle = np.arcsin(sine)
    t = 1.0 - edge + edge * sine
    angles = angle[..., None] * (1.0 - _MIDPOINTS**2)  # within the edge; the square removes the singularity at r = t
    r = 1.0 - edge + edge * np.sin(angles)
    integrand = 2.0 * _MIDPOINTS * np.sin(angles) / np.sqrt(t[..., None] ** 2 - r**2)
    return np.asarray(t * edge * angle * integrand.mean(axis=-1))

"""Principal stretches of axisymmetric deformations, and the frame in which any isotropic energy bends separately.

Deformations are F = (F_rr, F_rz, F_zr, F_zz, F_tt), the last one the hoop stretch, shape (5, ...).
"""

import math

import numpy as np

from solve.arrays import Floats

_SAME = 1e-7  # relative difference of stretches under which a quotient of differences is worse than its limit


def principal_stretches(F: Floats) -> Floats:
    """Return those in the plane, the larger one first, and the hoop, shape (3, ...) [1]; negative when turned over."""
    same, turn, apart, shear = _parts(F)
    mean, difference = np.hypot(same, turn), np.hypot(apart, shear)
    return np.stack([mean + difference, mean - difference, F[4]])


def principal_modes(F: Floats) -> Floats:
    """Return the frame of the principal stretches in the plane, shape (4 modes, 4, ...) [1].

    The modes are the two stretches in the plane, its turn and its shear: in them, and in the hoop, the second
    derivative of any isotropic energy is diagonal. B. Smith, F. de Goes, T. Kim, ACM Trans. Graph. 38, 2019, doi
    10.1145/3241041.
    """
    same, turn, apart, shear = _parts(F)
    keeps, bends = _direction(same, turn), _direction(apart, shear)
    mean = np.stack([keeps[0], -keeps[1], keeps[1], keeps[0]])
    difference = np.stack([bends[0], bends[1], bends[1], -bends[0]])
    turned = np.stack([-keeps[1], -keeps[0], keeps[0], -keeps[1]])
    sheared = np.stack([-bends[1], bends[0], bends[0], bends[1]])
    half, root = 0.5, math.sqrt(0.5)
    return np.stack([half * (mean + difference), half * (mean - difference), root * turned, root * sheared])


def mode_stiffness(stretches: Floats, slope: Floats, curvature: Floats, pressure: Floats) -> Floats:
    """Return the second derivative in each mode and the hoop, shape (5, ...), of phi(l1) + phi(l2) + phi(l3) + p ln J.

    `slope` and `curvature` (3, ...) are those of phi, `pressure` (...) is p, all in one unit; J = l1 l2 l3.
    """
    l1, l2 = stretches[0], stretches[1]
    apart = l1 - l2
    same = apart < _SAME * l1
    quotient = (slope[0] - slope[1]) / np.where(same, 1.0, apart)
    shear = np.where(same, 0.5 * (curvature[0] + curvature[1]), quotient)
    turn = (slope[0] + slope[1]) / (l1 + l2)
    along = curvature - pressure / stretches**2
    in_plane = pressure / (l1 * l2)
    return np.stack([along[0], along[1], turn + in_plane, shear - in_plane, along[2]])


def _parts(F: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the parts of F in the plane that keep angles, and those that do not."""
    rr, rz, zr, zz = F[:4]
    return 0.5 * (rr + zz), 0.5 * (zr - rz), 0.5 * (rr - zz), 0.5 * (zr + rz)


def _direction(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return cosine and sine of the angle of (x, y); of no length: that of the first axis."""
    length = np.hypot(x, y)
    none = length == 0.0
    length = np.where(none, 1.0, length)
    return np.where(none, 1.0, x / length), y / length

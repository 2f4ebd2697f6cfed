"""Principal stretches of axisymmetric deformations, and the modes in which any isotropic energy has a diagonal Hessian.

A deformation gradient F has the components (F_rr, F_rz, F_zr, F_zz, F_tt), the last one the hoop stretch, shape (5,
...). In the plane it is the sum of a scaled rotation (mean, turn) and a scaled reflection (difference, shear).
"""

import math

import numpy as np

from sensor.arrays import Floats

_EQUAL = 1e-7  # relative difference of stretches below which the limit of a quotient of differences is used


def principal_stretches(F: Floats) -> Floats:
    """Return the stretches in the plane, the larger one first, and the hoop stretch, shape (3, ...) [1].

    A negative stretch means an inverted element.
    """
    rr, rz, zr, zz, hoop = F
    mean = np.hypot(0.5 * (rr + zz), 0.5 * (zr - rz))
    difference = np.hypot(0.5 * (rr - zz), 0.5 * (zr + rz))
    return np.stack([mean + difference, mean - difference, hoop])


def principal_modes(F: Floats) -> Floats:
    """Return the four modes of F in the plane, shape (4 modes, 4 components of F, ...) [1].

    The modes are the two stretches in the plane, its turn and its shear. In these modes and the hoop stretch, the
    second derivative of any isotropic energy is diagonal. B. Smith, F. de Goes, T. Kim, ACM Trans. Graph. 38, 2019, doi
    10.1145/3241041.
    """
    rr, rz, zr, zz = F[:4]
    rotation_cos, rotation_sin = _direction(0.5 * (rr + zz), 0.5 * (zr - rz))
    reflection_cos, reflection_sin = _direction(0.5 * (rr - zz), 0.5 * (zr + rz))
    # Derivatives over F of half the sum and half the difference of the stretches, and the directions orthogonal to
    # them.
    mean = np.stack([rotation_cos, -rotation_sin, rotation_sin, rotation_cos])
    difference = np.stack([reflection_cos, reflection_sin, reflection_sin, -reflection_cos])
    turn = np.stack([-rotation_sin, -rotation_cos, rotation_cos, -rotation_sin])
    shear = np.stack([-reflection_sin, reflection_cos, reflection_cos, reflection_sin])
    root = math.sqrt(0.5)
    return np.stack([0.5 * (mean + difference), 0.5 * (mean - difference), root * turn, root * shear])


def mode_stiffness(stretches: Floats, slope: Floats, curvature: Floats, pressure: Floats) -> Floats:
    """Return the second derivatives of phi(l1) + phi(l2) + phi(l3) + p ln J in the modes and the hoop, (5, ...).

    `slope` and `curvature` (3, ...) belong to phi at the stretches l, `pressure` (...) is p, all in one unit; J = l1 l2
    l3. A mode that is a stretch has the second derivative over it. The turn changes neither stretch to first order, so
    its stiffness is (phi'(l1) + phi'(l2)) / (l1 + l2), and for the shear (phi'(l1) - phi'(l2)) / (l1 - l2).
    """
    l1, l2, _ = stretches
    difference = l1 - l2
    equal = difference < _EQUAL * l1
    quotient = (slope[0] - slope[1]) / np.where(equal, 1.0, difference)
    shear = np.where(equal, 0.5 * (curvature[0] + curvature[1]), quotient)  # the limit, for equal stretches
    turn = (slope[0] + slope[1]) / (l1 + l2)
    along = curvature - pressure / stretches**2
    in_plane = pressure / (l1 * l2)
    return np.stack([along[0], along[1], turn + in_plane, shear - in_plane, along[2]])


def _direction(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return cosine and sine of the angle of (x, y); 1 and 0 for a vector of zero length."""
    length = np.hypot(x, y)
    zero = length == 0.0
    length = np.where(zero, 1.0, length)
    return np.where(zero, 1.0, x / length), y / length

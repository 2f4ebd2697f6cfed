"""Principal stretches of axisymmetric deformations, and the modes in which any isotropic energy has a diagonal Hessian.

A deformation gradient F (5, ...) has the components (F_rr, F_rz, F_zr, F_zz, F_tt), where F_tt is the hoop stretch. The
in-plane 2 x 2 part is the sum of a scaled rotation and a scaled reflection. The two scale factors are half the sum and
half the difference of the in-plane principal stretches.
"""

import math

import numpy as np

from sensor.arrays import Floats

_EQUAL_TOLERANCE = 1e-7  # relative difference of stretches below which a difference quotient is replaced by its limit


def principal_stretches(F: Floats) -> Floats:
    """Return the two in-plane stretches, the larger one first, and the hoop stretch [1], shape (3, ...).

    A negative stretch means that the element is inverted.
    """
    rr, rz, zr, zz, hoop = F
    mean = np.hypot(0.5 * (rr + zz), 0.5 * (zr - rz))  # scale factor of the rotation
    half_difference = np.hypot(0.5 * (rr - zz), 0.5 * (zr + rz))  # scale factor of the reflection
    return np.stack([mean + half_difference, mean - half_difference, hoop])


def principal_modes(F: Floats) -> Floats:
    """Return the four orthonormal modes of the in-plane part of F [1], shape (4 modes, 4 components of F, ...).

    A mode is a direction in which F changes. `F` (5, ...) [1] has the in-plane components F_rr, F_rz, F_zr and F_zz.
    The first two modes each change one of the in-plane stretches. The third mode is a rotation, and the fourth is a
    shear. With the hoop stretch as the fifth mode, the second derivative of any isotropic energy is diagonal. See B.
    Smith, F. de Goes, T. Kim, ACM Trans. Graph. 38, 2019, doi 10.1145/3241041.
    """
    rr, rz, zr, zz = F[:4]
    rotation_cos, rotation_sin = _cosine_and_sine(0.5 * (rr + zz), 0.5 * (zr - rz))
    reflection_cos, reflection_sin = _cosine_and_sine(0.5 * (rr - zz), 0.5 * (zr + rz))
    # The gradients are the derivatives of the sum and of the difference of the stretches with respect to F. The other
    # two directions are orthogonal to the gradients.
    sum_gradient = np.stack([rotation_cos, -rotation_sin, rotation_sin, rotation_cos])
    difference_gradient = np.stack([reflection_cos, reflection_sin, reflection_sin, -reflection_cos])
    rotation = np.stack([-rotation_sin, -rotation_cos, rotation_cos, -rotation_sin])
    shear = np.stack([-reflection_sin, reflection_cos, reflection_cos, reflection_sin])
    normalisation = math.sqrt(0.5)  # each of the four directions has the length sqrt(2)
    return np.stack(
        [
            0.5 * (sum_gradient + difference_gradient),
            0.5 * (sum_gradient - difference_gradient),
            normalisation * rotation,
            normalisation * shear,
        ]
    )


def mode_stiffness(stretches: Floats, slope: Floats, curvature: Floats, pressure: Floats) -> Floats:
    """Return the second derivatives of phi(l1) + phi(l2) + phi(l3) + p ln J in the five modes, shape (5, ...).

    The first four modes come from `principal_modes`: two stretches, a rotation and a shear. The fifth is the hoop
    stretch. `slope` and `curvature` (3, ...) are phi' and phi'' at the `stretches` l, and `pressure` (...) is p, all in
    the same unit. J is l1 l2 l3.

    In a stretch mode the result is phi''(l) - p / l^2. A rotation and a shear do not change the stretches to first
    order, and their stiffnesses are

        (phi'(l1) + phi'(l2)) / (l1 + l2) + p / (l1 l2)    for the rotation,
        (phi'(l1) - phi'(l2)) / (l1 - l2) - p / (l1 l2)    for the shear.
    """
    l1, l2, _ = stretches
    difference = l1 - l2
    # For equal stretches, the difference quotient of phi' is 0 / 0. Its limit is the second derivative of phi.
    is_equal = difference < _EQUAL_TOLERANCE * l1
    quotient = (slope[0] - slope[1]) / np.where(is_equal, 1.0, difference)
    shear = np.where(is_equal, 0.5 * (curvature[0] + curvature[1]), quotient)
    rotation = (slope[0] + slope[1]) / (l1 + l2)
    stretch_stiffness = curvature - pressure / stretches**2
    pressure_term = pressure / (l1 * l2)
    return np.stack(
        [
            stretch_stiffness[0],
            stretch_stiffness[1],
            rotation + pressure_term,
            shear - pressure_term,
            stretch_stiffness[2],
        ]
    )


def _cosine_and_sine(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the cosine and sine of the polar angle of the vector (x, y), or 1 and 0 if its length is zero."""
    length = np.hypot(x, y)
    is_zero = length == 0.0
    divisor = np.where(is_zero, 1.0, length)
    return np.where(is_zero, 1.0, x / divisor), y / divisor

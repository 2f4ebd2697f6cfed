"""Principal stretches of axisymmetric deformations, and the modes in which any isotropic energy has a diagonal Hessian.

A deformation gradient F (5, ...) has the components (F_rr, F_rz, F_zr, F_zz, F_tt), of which the last is the hoop
stretch. Its in-plane 2 x 2 part is the sum of a scaled rotation and a scaled reflection. The factors of the two are
half the sum and half the difference of the principal stretches.
"""

import math

import numpy as np

from sensor.arrays import Floats

_EQUAL = 1e-7  # relative difference of stretches below which a difference quotient is replaced by its limit


def principal_stretches(F: Floats) -> Floats:
    """Return both in-plane stretches, the larger one first, and the hoop stretch [1], shape (3, ...).

    A negative stretch means an inverted element.
    """
    rr, rz, zr, zz, hoop = F
    mean = np.hypot(0.5 * (rr + zz), 0.5 * (zr - rz))  # factor of the rotation
    half_difference = np.hypot(0.5 * (rr - zz), 0.5 * (zr + rz))  # factor of the reflection
    return np.stack([mean + half_difference, mean - half_difference, hoop])


def principal_modes(F: Floats) -> Floats:
    """Return the four orthonormal modes of the in-plane part of F [1], shape (4 modes, 4 components of F, ...).

    The modes are changes of F: of the first stretch, of the second stretch, by a rotation, and by a shear. With the
    hoop stretch as the fifth mode, the second derivative of any isotropic energy is diagonal. See B. Smith, F. de Goes,
    T. Kim, ACM Trans. Graph. 38, 2019, doi 10.1145/3241041.
    """
    rr, rz, zr, zz = F[:4]
    rotation_cos, rotation_sin = _cosine_and_sine(0.5 * (rr + zz), 0.5 * (zr - rz))
    reflection_cos, reflection_sin = _cosine_and_sine(0.5 * (rr - zz), 0.5 * (zr + rz))
    # The derivatives by F of the sum and of the difference of the stretches, and the directions orthogonal to them.
    of_sum = np.stack([rotation_cos, -rotation_sin, rotation_sin, rotation_cos])
    of_difference = np.stack([reflection_cos, reflection_sin, reflection_sin, -reflection_cos])
    rotation = np.stack([-rotation_sin, -rotation_cos, rotation_cos, -rotation_sin])
    shear = np.stack([-reflection_sin, reflection_cos, reflection_cos, reflection_sin])
    normalisation = math.sqrt(0.5)
    return np.stack(
        [
            0.5 * (of_sum + of_difference),
            0.5 * (of_sum - of_difference),
            normalisation * rotation,
            normalisation * shear,
        ]
    )


def mode_stiffness(stretches: Floats, slope: Floats, curvature: Floats, pressure: Floats) -> Floats:
    """Return the second derivatives of phi(l1) + phi(l2) + phi(l3) + p ln J in the five modes, shape (5, ...).

    The modes are those of `principal_modes` and the hoop stretch, and J = l1 l2 l3. `slope` and `curvature` (3, ...)
    are the first and second derivatives of phi at the `stretches` l. `pressure` (...) is p, in the same unit. For a
    stretch, the result is the second derivative by this stretch. A rotation and a shear do not change the stretches to
    first order. Their stiffnesses are (phi'(l1) + phi'(l2)) / (l1 + l2) + p / (l1 l2) and (phi'(l1) - phi'(l2)) / (l1 -
    l2) - p / (l1 l2).
    """
    l1, l2, _ = stretches
    difference = l1 - l2
    is_equal = difference < _EQUAL * l1
    quotient = (slope[0] - slope[1]) / np.where(is_equal, 1.0, difference)
    shear = np.where(is_equal, 0.5 * (curvature[0] + curvature[1]), quotient)
    rotation = (slope[0] + slope[1]) / (l1 + l2)
    of_stretches = curvature - pressure / stretches**2
    from_pressure = pressure / (l1 * l2)
    return np.stack(
        [of_stretches[0], of_stretches[1], rotation + from_pressure, shear - from_pressure, of_stretches[2]]
    )


def _cosine_and_sine(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return the cosine and the sine of the angle of the vector (x, y); 1 and 0 for a vector of zero length."""
    length = np.hypot(x, y)
    is_zero = length == 0.0
    length = np.where(is_zero, 1.0, length)
    return np.where(is_zero, 1.0, x / length), y / length

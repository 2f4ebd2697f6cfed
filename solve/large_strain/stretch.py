"""Principal stretches of axisymmetric deformations, and the frame in which any isotropic energy bends separately.

Deformations are F = (F_rr, F_rz, F_zr, F_zz, F_tt), the last one the hoop stretch, shape (..., 5).
"""

import math

import numpy as np

from solve.arrays import Floats

STRETCH_MODES = (0, 1, 4)  # of the five modes
_SAME = 1e-7  # relative difference of stretches under which a quotient of differences is worse than its limit


def principal_stretches(F: Floats) -> Floats:
    """Return those in the plane, the larger one first, and the hoop, shape (..., 3) [1]; negative when turned over."""
    same, turn, apart, shear = _parts(F)
    mean, difference = np.hypot(same, turn), np.hypot(apart, shear)
    return np.stack([mean + difference, mean - difference, F[..., 4]], axis=-1)


def principal_modes(F: Floats) -> Floats:
    """Return the frame of the principal stretches, shape (..., 5 modes, 5) [1].

    The modes are the two stretches in the plane, its turn, its shear and the hoop: in them the second derivative of
    any isotropic energy is diagonal. B. Smith, F. de Goes, T. Kim, ACM Trans. Graph. 38, 2019, doi 10.1145/3241041.
    """
    single = _single_stretches(F)
    crossed, returned = single[..., 0, 1, :], single[..., 1, 0, :]
    modes = np.zeros((*F.shape[:-1], 5, 5))
    modes[..., 0, :4] = single[..., 0, 0, :]
    modes[..., 1, :4] = single[..., 1, 1, :]
    modes[..., 2, :4] = math.sqrt(0.5) * (returned - crossed)
    modes[..., 3, :4] = math.sqrt(0.5) * (returned + crossed)
    modes[..., 4, 4] = 1.0
    return modes


def _single_stretches(F: Floats) -> Floats:
    """Return the deformations in the plane of one stretch alone, from each to each axis, shape (..., 2, 2, 4)."""
    same, turn, apart, shear = _parts(F)
    total, between = np.arctan2(turn, same), np.arctan2(shear, apart)
    # F = after diag(stretches) before
    before, after = _rotation(0.5 * (total - between)), _rotation(0.5 * (total + between))
    products = after.swapaxes(-1, -2)[..., :, None, :, None] * before[..., None, :, None, :]
    return products.reshape(*F.shape[:-1], 2, 2, 4)


def mode_stiffness(stretches: Floats, slope: Floats, curvature: Floats, pressure: Floats) -> Floats:
    """Return the second derivative in each mode, shape (..., 5), of phi(l1) + phi(l2) + phi(l3) + p ln(l1 l2 l3).

    `slope` and `curvature` (..., 3) are those of phi, `pressure` (...) is p, all in one unit.
    """
    l1, l2 = stretches[..., 0], stretches[..., 1]
    apart = l1 - l2
    same = apart < _SAME * l1
    quotient = (slope[..., 0] - slope[..., 1]) / np.where(same, 1.0, apart)
    shear = np.where(same, 0.5 * (curvature[..., 0] + curvature[..., 1]), quotient)
    turn = (slope[..., 0] + slope[..., 1]) / (l1 + l2)
    along = curvature - pressure[..., None] / stretches**2
    in_plane = pressure / (l1 * l2)
    return np.stack([along[..., 0], along[..., 1], turn + in_plane, shear - in_plane, along[..., 2]], axis=-1)


def _parts(F: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the parts of F in the plane that keep angles, and those that do not."""
    rr, rz, zr, zz = np.moveaxis(F[..., :4], -1, 0)
    return 0.5 * (rr + zz), 0.5 * (zr - rz), 0.5 * (rr - zz), 0.5 * (zr + rz)


def _rotation(angle: Floats) -> Floats:
    """Return matrices that turn by angles, shape (..., 2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)

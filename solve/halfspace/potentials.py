"""Displacements and stresses in an elastic half-space z >= 0 under normal pressure on z = 0, in closed form.

All fields follow from one harmonic potential phi. For a unit point load, phi is ln(R + z) (Boussinesq). For a uniform
pressure, phi is the integral of this function over the loaded area (Love). With psi = d phi/dz and
c = (1 + nu) / (2 pi E):

    u_x = c (-z psi,x - (1 - 2 nu) phi,x)        u_z = c (-z psi,z + 2 (1 - nu) psi)
    2 pi sigma_xx = -z psi,xx - (1 - 2 nu) phi,xx + 2 nu psi,z      2 pi sigma_xy = -z psi,xy - (1 - 2 nu) phi,xy
    2 pi sigma_zz = psi,z - z psi,zz                                2 pi sigma_xz = -z psi,xz

Coordinates are in mm. The z axis points into the body, and a load pushes along +z. Sources: A. E. H. Love, Phil. Trans.
R. Soc. A 228 (1929) 377, doi:10.1098/rsta.1929.0009; K. L. Johnson, Contact Mechanics (1985), sections 3.2 to 3.4,
doi:10.1017/CBO9781139171731.
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

TINY = 1e-150  # added to lengths and to their squares to avoid 0 / 0


@dataclass(frozen=True)
class Potentials:
    """The depth z [mm], and the derivatives of phi and psi = phi,z, at points; all arrays have the same shape."""

    z: Floats
    phi_x: Floats
    phi_y: Floats
    psi: Floats
    phi_xx: Floats
    phi_xy: Floats
    phi_yy: Floats
    psi_x: Floats
    psi_y: Floats
    psi_xx: Floats
    psi_xy: Floats
    psi_yy: Floats
    psi_xz: Floats
    psi_yz: Floats


def displacement(f: Potentials, E: float, poisson: float) -> Floats:
    """Return the displacement u = (u_x, u_y, u_z) [mm] under a load, shape (3, ...).

    `f` holds the derivatives of the potential phi of a unit load: a force of 1 N or a pressure of 1 MPa. E is in MPa.
    With psi = d phi/dz, the components are

        u_x = c (-z psi,x - (1 - 2 nu) phi,x),    u_z = c (-z psi,z + 2 (1 - nu) psi),    c = (1 + nu) / (2 pi E),

    and u_y is analogous to u_x.
    """
    c = (1.0 + poisson) / (2.0 * np.pi * E)
    kappa = 1.0 - 2.0 * poisson
    psi_z = -(f.phi_xx + f.phi_yy)  # because phi is harmonic
    return c * np.stack(
        [
            -f.z * f.psi_x - kappa * f.phi_x,
            -f.z * f.psi_y - kappa * f.phi_y,
            -f.z * psi_z + 2.0 * (1.0 - poisson) * f.psi,
        ]
    )


def stress(f: Potentials, poisson: float) -> Floats:
    """Return the stress sigma [MPa] under a load, shape (3, 3, ...); tension is positive.

    `f` holds the derivatives of the potential phi of a unit load: a force of 1 N or a pressure of 1 MPa. The docstring
    of this module gives the formulas for the components. sigma_yy and sigma_yz follow by exchanging x and y.
    """
    kappa = 1.0 - 2.0 * poisson
    psi_z = -(f.phi_xx + f.phi_yy)  # because phi is harmonic
    xx = -f.z * f.psi_xx - kappa * f.phi_xx + 2.0 * poisson * psi_z
    yy = -f.z * f.psi_yy - kappa * f.phi_yy + 2.0 * poisson * psi_z
    zz = psi_z + f.z * (f.psi_xx + f.psi_yy)
    xy = -f.z * f.psi_xy - kappa * f.phi_xy
    xz = -f.z * f.psi_xz
    yz = -f.z * f.psi_yz
    rows = [np.stack([xx, xy, xz]), np.stack([xy, yy, yz]), np.stack([xz, yz, zz])]
    return np.stack(rows) / (2.0 * np.pi)


def point_load(x: Floats, y: Floats, z: Floats) -> Potentials:
    """Return the potentials of a unit normal force at the origin (Boussinesq), at points x, y, z [mm] of any shape.

    R is the distance from the force, phi = ln(R + z) and psi = 1 / R. The fields are infinite at the origin. Both
    potentials are symmetric about the z axis, so their derivatives along x and y share a few factors.
    """
    R = np.sqrt(x * x + y * y + z * z)
    S = R + z
    phi_x_over_x = 1.0 / (R * S)  # equal to phi,y / y
    inverse_cube = phi_x_over_x * S / R**2  # 1 / R^3
    decrease_over_x = (R + S) * inverse_cube / S**2  # -d(phi_x_over_x)/dx divided by x; the same for y
    three_over_fifth = 3.0 / R**5
    return Potentials(
        z=z,
        phi_x=x * phi_x_over_x,
        phi_y=y * phi_x_over_x,
        psi=1.0 / R,
        phi_xx=phi_x_over_x - x * x * decrease_over_x,
        phi_xy=-x * y * decrease_over_x,
        phi_yy=phi_x_over_x - y * y * decrease_over_x,
        psi_x=-x * inverse_cube,
        psi_y=-y * inverse_cube,
        psi_xx=x * x * three_over_fifth - inverse_cube,
        psi_xy=x * y * three_over_fifth,
        psi_yy=y * y * three_over_fifth - inverse_cube,
        psi_xz=x * z * three_over_fifth,
        psi_yz=y * z * three_over_fifth,
    )


def rectangle_load(x: Floats, y: Floats, z: Floats, length: float, width: float) -> Potentials:
    """Return the potentials of a unit pressure on a rectangle centred at the origin (Love), at points x, y, z [mm].

    The arrays of points may have any shape. `length` [mm] is the side of the rectangle along x, and `width` [mm] the
    side along y. Second derivatives are infinite on the edges of the rectangle. The integral over the rectangle is the
    sum of a function of the four corners with alternating signs; see `_corner_terms`.
    """
    # The names give the signs of x and y: "low_high" is the corner at x = -length / 2 and y = width / 2.
    low_low = _corner_terms(x + 0.5 * length, y + 0.5 * width, z)
    high_low = _corner_terms(x - 0.5 * length, y + 0.5 * width, z)
    low_high = _corner_terms(x + 0.5 * length, y - 0.5 * width, z)
    high_high = _corner_terms(x - 0.5 * length, y - 0.5 * width, z)
    corners = zip(low_low, high_low, low_high, high_high, strict=True)
    return Potentials(z, *(a - b - c + d for a, b, c, d in corners))


def _corner_terms(X: Floats, Y: Floats, z: Floats) -> list[Floats]:
    """Return the contribution of one corner of a rectangle to each field of `Potentials` except z, for unit pressure.

    X and Y [mm] are the coordinates of points relative to this corner. The result is in the order of the fields. Each
    contribution F satisfies F,XY = f, where f is the same field for a unit point load. The sum of F over the four
    corners, with alternating signs, is therefore the integral of f over the rectangle. Terms that depend only on X or
    only on Y cancel in this sum and are omitted.
    """
    # TINY keeps the terms finite on the lines X = z = 0 and Y = z = 0. There the infinite terms tend to zero or cancel
    # in the sum over the corners.
    R = np.sqrt(X**2 + Y**2 + z**2)
    inverse_R = 1.0 / (R + TINY)
    xz_squared = X**2 + z**2 + TINY
    yz_squared = Y**2 + z**2 + TINY
    log_x = np.arcsinh(Y / np.sqrt(xz_squared))
    log_y = np.arcsinh(X / np.sqrt(yz_squared))
    log_z = np.log(R + z + TINY)
    # phi_xx is atan(Y / X) - atan(z Y / (X R)), written as one arctangent. In phi_yy, X and Y are exchanged.
    phi_xx = np.arctan2(X * Y * (R - z), X * X * R + z * Y * Y)
    phi_yy = np.arctan2(Y * X * (R - z), Y * Y * R + z * X * X)
    log_x_slope = -Y * inverse_R / xz_squared  # d log_x / dX divided by X, and d log_x / dz divided by z
    log_y_slope = -X * inverse_R / yz_squared  # d log_y / dY divided by Y, and d log_y / dz divided by z
    return [
        Y * log_z + z * log_x + X * phi_xx,  # phi,x
        X * log_z + z * log_y + Y * phi_yy,  # phi,y
        X * log_x + Y * log_y - z * (phi_xx + phi_yy),  # psi
        phi_xx,
        log_z,  # phi,xy
        phi_yy,
        log_x,  # psi,x
        log_y,  # psi,y
        X * log_x_slope,  # psi,xx
        inverse_R,  # psi,xy
        Y * log_y_slope,  # psi,yy
        z * log_x_slope,  # psi,xz
        z * log_y_slope,  # psi,yz
    ]

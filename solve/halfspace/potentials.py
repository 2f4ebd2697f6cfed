"""Elastic half-space z >= 0 under normal pressure on z = 0: displacements and stresses in closed form.

Every field follows from one harmonic potential phi. For a unit point load it is ln(R + z) (Boussinesq), for a pressure
the integral of this over the loaded area (Love). With psi = d phi/dz and c = (1 + nu) / (2 pi E):

    u_x = c (-z psi,x - (1 - 2 nu) phi,x)        u_z = c (-z psi,z + 2 (1 - nu) psi)
    2 pi sigma_xx = -z psi,xx - (1 - 2 nu) phi,xx + 2 nu psi,z      2 pi sigma_xy = -z psi,xy - (1 - 2 nu) phi,xy
    2 pi sigma_zz = psi,z - z psi,zz                                2 pi sigma_xz = -z psi,xz

x, y, z in mm, z into the body; a load pushes along +z. Sources: Love, Phil. Trans. R. Soc. A 228 (1929) 377,
doi:10.1098/rsta.1929.0009; Johnson, Contact Mechanics (1985), sections 3.2 to 3.4, doi:10.1017/CBO9781139171731.
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats

TINY = 1e-150  # avoids 0 / 0


@dataclass(frozen=True)
class Potentials:
    """First and second derivatives of phi, and z; psi is phi,z. All have one shape."""

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
    """Return u = (u_x, u_y, u_z) [mm for the load in N or MPa, E in MPa], shape (3, ...)."""
    c = (1.0 + poisson) / (2.0 * np.pi * E)
    kappa = 1.0 - 2.0 * poisson
    psi_z = -(f.phi_xx + f.phi_yy)
    return c * np.stack(
        [
            -f.z * f.psi_x - kappa * f.phi_x,
            -f.z * f.psi_y - kappa * f.phi_y,
            -f.z * psi_z + 2.0 * (1.0 - poisson) * f.psi,
        ]
    )


def stress(f: Potentials, poisson: float) -> Floats:
    """Return sigma [MPa for the load in N or MPa], tension positive, shape (3, 3, ...)."""
    kappa = 1.0 - 2.0 * poisson
    psi_z = -(f.phi_xx + f.phi_yy)
    xx = -f.z * f.psi_xx - kappa * f.phi_xx + 2.0 * poisson * psi_z
    yy = -f.z * f.psi_yy - kappa * f.phi_yy + 2.0 * poisson * psi_z
    zz = psi_z + f.z * (f.psi_xx + f.psi_yy)
    xy = -f.z * f.psi_xy - kappa * f.phi_xy
    xz = -f.z * f.psi_xz
    yz = -f.z * f.psi_yz
    rows = [np.stack([xx, xy, xz]), np.stack([xy, yy, yz]), np.stack([xz, yz, zz])]
    return np.stack(rows) / (2.0 * np.pi)


def point_load(x: Floats, y: Floats, z: Floats) -> Potentials:
    """Return the potentials of a unit normal force at the origin (Boussinesq), at points of any one shape [mm].

    With R the distance from the force, phi = ln(R + z) and psi = 1 / R. The fields are infinite at the origin.
    """
    R = np.sqrt(x * x + y * y + z * z)
    S = R + z
    flat = 1.0 / (R * S)  # phi,x / x
    cube = flat * S / R**2  # 1 / R^3
    bend = (R + S) * cube / S**2  # -(d flat / dx) / x
    fifth = 3.0 / R**5
    return Potentials(
        z=z,
        phi_x=x * flat,
        phi_y=y * flat,
        psi=1.0 / R,
        phi_xx=flat - x * x * bend,
        phi_xy=-x * y * bend,
        phi_yy=flat - y * y * bend,
        psi_x=-x * cube,
        psi_y=-y * cube,
        psi_xx=x * x * fifth - cube,
        psi_xy=x * y * fifth,
        psi_yy=y * y * fifth - cube,
        psi_xz=x * z * fifth,
        psi_yz=y * z * fifth,
    )


def rectangle_load(x: Floats, y: Floats, z: Floats, length: float, width: float) -> Potentials:
    """Return the potentials of unit pressure on a rectangle centred at the origin (Love), at points of one shape [mm].

    `length` is along x, `width` along y [mm]. Second derivatives are infinite on the edges of the rectangle.
    """
    right = _corner(x + 0.5 * length, y + 0.5 * width, z)
    left = _corner(x - 0.5 * length, y + 0.5 * width, z)
    right_back = _corner(x + 0.5 * length, y - 0.5 * width, z)
    left_back = _corner(x - 0.5 * length, y - 0.5 * width, z)
    return Potentials(z, *(a - b - c + d for a, b, c, d in zip(right, left, right_back, left_back, strict=True)))


def _corner(X: Floats, Y: Floats, z: Floats) -> list[Floats]:
    """Return the potentials except z of unit pressure on the quadrant that starts at a corner of a rectangle.

    X and Y [mm] are the coordinates of points from this corner. Each function F in the list satisfies F,XY = f, with f
    the derivative of phi that `Potentials` has at this position. The sum of F over the four corners, with alternating
    signs, is the integral of f over the rectangle. Terms that depend only on X or only on Y cancel in this sum and are
    left out.
    """
    # TINY keeps the line X = z = 0 finite; there each term tends to zero or cancels in the sum over the corners.
    R = np.sqrt(X**2 + Y**2 + z**2)
    over_R = 1.0 / (R + TINY)
    xz = X**2 + z**2 + TINY
    yz = Y**2 + z**2 + TINY
    log_x = np.arcsinh(Y / np.sqrt(xz))
    log_y = np.arcsinh(X / np.sqrt(yz))
    log_z = np.log(R + z + TINY)
    # atan(Y / X) - atan(z Y / (X R)) as one arctangent, and the same with X and Y exchanged
    phi_xx = np.arctan2(X * Y * (R - z), X * X * R + z * Y * Y)
    phi_yy = np.arctan2(Y * X * (R - z), Y * Y * R + z * X * X)
    log_x_z = -Y * over_R / xz  # d log_x / dX over X, and d log_x / dz over z
    log_y_z = -X * over_R / yz
    return [
        Y * log_z + z * log_x + X * phi_xx,  # phi,x
        X * log_z + z * log_y + Y * phi_yy,  # phi,y
        X * log_x + Y * log_y - z * (phi_xx + phi_yy),  # psi
        phi_xx,
        log_z,  # phi,xy
        phi_yy,
        log_x,  # psi,x
        log_y,  # psi,y
        X * log_x_z,  # psi,xx
        over_R,  # psi,xy
        Y * log_y_z,  # psi,yy
        z * log_x_z,  # psi,xz
        z * log_y_z,  # psi,yz
    ]

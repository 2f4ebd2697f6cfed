"""Hertz's law for the contact of smooth bodies: a dome on a fruit, a fruit on a table, a fruit between plates.

Two bodies that touch at a point approach each other by d under the force F = 4/3 E* sqrt(R) d^(3/2). If one of them is
rigid, E* = E / (1 - nu^2). K. L. Johnson, Contact Mechanics (1985), chapter 4, doi:10.1017/CBO9781139171731. Units: mm,
N, MPa.
"""

import math


def hertz_factor(radius: float, poisson: float) -> float:
    """Return h [mm (MPa/N)^(2/3)] in d = h (F / E)^(2/3) for a relative radius of curvature [mm].

    This is F = 4/3 E / (1 - nu^2) sqrt(R) d^(3/2), Johnson (4.23), solved for d.
    """
    return math.pow(0.75 * (1.0 - poisson**2) / math.sqrt(radius), 2.0 / 3.0)


def force_factor(reduced_modulus: float, radius: float) -> float:
    """Return c [N mm^(-3/2)] in F = c d^(3/2) for E* = E / (1 - nu^2) [MPa] and a relative radius of curvature [mm].

    By Johnson (4.23), c = 4/3 E* sqrt(R).
    """
    return 4.0 / 3.0 * reduced_modulus * math.sqrt(radius)


def relative_radius(dome_radius: float, fruit_radius: float) -> float:
    """Return the relative radius R* of a dome on a fruit [mm]: 1/R* = 1/r + 1/R.

    A sphere of radius R* in contact with a plane obeys the same law.
    """
    return 1.0 / (1.0 / dome_radius + 1.0 / fruit_radius)


def approach(force: float, E: float, poisson: float, radius: float) -> float:
    """Return the approach [mm] of two bodies of relative radius `radius` [mm] under `force` [N]. E is in MPa."""
    return hertz_factor(radius, poisson) * math.pow(max(force, 0.0) / E, 2.0 / 3.0)


def contact_radius(force: float, E: float, poisson: float, radius: float) -> float:
    """Return the contact radius a = sqrt(R* d) of a dome [mm from N, MPa, mm], or 0 if it is out of contact."""
    return math.sqrt(radius * approach(force, E, poisson, radius))


def contact_reach(force: float, E: float, poisson: float, radius: float, slope: float) -> float:
    """Return the distance from the axis of a dome to the edge of its contact [mm] on a fruit inclined by a slope [1].

    The point of first contact lies at the distance slope times R* from the axis, with R* the relative `radius` [mm].
    """
    return slope * radius + contact_radius(force, E, poisson, radius)


def equivalent_radius(radius: float, radius_across: float) -> float:
    """Return the radius [mm] of the sphere that approaches a plate as far as a body with two principal radii.

    Both bodies carry the same force. `radius` and `radius_across` [mm] are the principal radii of the body, in any
    order. The contact of the body is an ellipse with half axes a > b: Johnson (4.26) to (4.28). The ratio of the radii
    determines m = 1 - (b / a)^2, the square of the eccentricity of this ellipse. Complete elliptic integrals are
    evaluated in Carlson's forms, as in `_approach_correction`.
    """
    from scipy.optimize import brentq  # rarely needed, and slow to import
    from scipy.special import elliprd

    smaller, larger = sorted((radius, radius_across))

    def excess(m: float) -> float:
        """Return the ratio of the radii of bodies whose contact ellipse has this m, minus the given ratio [1]."""
        return float(elliprd(0.0, 1.0, 1.0 - m) / elliprd(0.0, 1.0 - m, 1.0)) - larger / smaller

    # The bracket ends just below m = 1, where the ellipse would be infinitely long. The tolerance is round-off.
    m = brentq(excess, 0.0, 1.0 - 1e-15, xtol=1e-16)
    # The approach is proportional to F2 radius^(-1/3).
    F2 = _approach_correction(m)
    return math.sqrt(smaller * larger) / F2**3


def _approach_correction(m: float) -> float:
    """Return Johnson's correction factor F2 [1] of the approach of bodies whose contact ellipse has this m [1].

    With the half axes a > b of the ellipse, m is 1 - (b / a)^2. The complete elliptic integrals K(m) and E(m) are
    evaluated in Carlson's forms (https://dlmf.nist.gov/19.25), which do not subtract nearly equal numbers:

        K = R_F(0, 1 - m, 1),    K - E = m / 3 R_D(0, 1 - m, 1),    E / (1 - m) - K = m / 3 R_D(0, 1, 1 - m).
    """
    from scipy.special import elliprd, elliprf  # rarely needed, and slow to import

    axis_ratio = math.sqrt(1.0 - m)  # b / a
    K = float(elliprf(0.0, 1.0 - m, 1.0))
    # The following is sqrt([(a/b)^2 E(m) - K(m)] [K(m) - E(m)]) / m.
    integrals = math.sqrt(elliprd(0.0, 1.0, 1.0 - m) * elliprd(0.0, 1.0 - m, 1.0)) / 3.0
    F1 = math.cbrt(4.0 / math.pi * axis_ratio**1.5 * integrals)  # Johnson's correction factor for the contact size
    return 2.0 / math.pi * math.sqrt(axis_ratio) * K / F1

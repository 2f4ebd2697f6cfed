"""Isotropic hyperelastic laws of the flesh: a sum over the principal stretches plus a function of the volume.

    W = phi(l1) + phi(l2) + phi(l3) + U(theta),    theta = ln(l1 l2 l3)

W is the strain energy per undeformed volume for E = 1. The l are the principal stretches, which are the singular values
of the deformation gradient F. J = l1 l2 l3 is the volume ratio. mu and lambda are Lame's constants. All laws agree for
small strain. The Saint-Venant-Kirchhoff law is not offered, because it softens in compression until it collapses.
"""

from dataclasses import dataclass

import numpy as np

from sensor.arrays import Floats
from sensor.quantity import validation_error
from sensor.theory.soft_tissue import FLESH_LAWS, LARGEST_POISSON, FleshLawName
from solve.elasticity import lame_parameters

FOAM_EXPONENT = 4.0  # exponent of the stretches in the foam law


@dataclass(frozen=True, kw_only=True)
class FleshLaw:
    """A material law of the flesh, chosen by `name`, with Young's modulus 1 and a Poisson's ratio from 0 to 0.49.

    - neo-hooke: W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 ln^2 J, where I1 is the sum of l^2. J. C. Simo, K. S. Pister,
      Comput. Methods Appl. Mech. Eng. 46, 1984, doi 10.1016/0045-7825(84)90062-8.
    - hencky: W = mu sum ln^2 l + lambda/2 ln^2 J. H. Hencky, 1928.
    - foam: W = mu/8 (sum (l^4 - 1) + (J^(-4 b) - 1) / b), where b = nu / (1 - 2 nu). B. Storakers, J. Mech. Phys.
      Solids 34, 1986, doi 10.1016/0022-5096(86)90033-5, with exponent 4.
    """

    name: FleshLawName = "neo-hooke"
    poisson: float = 0.3

    def __post_init__(self) -> None:
        """Raise InputError for an unknown name or a Poisson's ratio outside the range."""
        if self.name not in FLESH_LAWS:
            raise validation_error("name", self.name, "", f"one of {', '.join(FLESH_LAWS)}", "use neo-hooke")
        if not 0.0 <= self.poisson <= LARGEST_POISSON:
            hint = "choose a ratio within this range, for which the elements were tested"
            raise validation_error("fruit.poisson", self.poisson, "", f"from 0 to {LARGEST_POISSON:g}", hint)

    def phi(self, stretch: Floats) -> tuple[Floats, Floats, Floats]:
        """Return phi, the strain-energy term of one principal stretch, and its first and second derivatives.

        `stretch` l [1] is an array of any shape, and the three results have the same shape. Young's modulus is 1.

        - neo-hooke: phi = mu/2 (l^2 - 1)
        - hencky: phi = mu ln^2 l
        - foam: phi = 2 mu / n^2 (l^n - 1), where n = 4
        """
        _, mu = lame_parameters(1.0, self.poisson)
        if self.name == "neo-hooke":
            return 0.5 * mu * (stretch**2 - 1.0), mu * stretch, np.full_like(stretch, mu)
        if self.name == "hencky":
            log = np.log(stretch)
            return mu * log**2, 2.0 * mu * log / stretch, 2.0 * mu * (1.0 - log) / stretch**2
        n = FOAM_EXPONENT  # only the foam law remains
        scale = 2.0 * mu / n**2
        power = stretch**n
        return scale * (power - 1.0), scale * n * power / stretch, scale * n * (n - 1.0) * power / stretch**2

    def U(self, theta: Floats) -> tuple[Floats, Floats, Floats]:
        """Return U, the strain-energy term of the volume, and its first and second derivatives with respect to theta.

        `theta` [1] is ln J, an array of any shape, and the three results have the same shape. Young's modulus is 1.

        - neo-hooke: U = (lambda/2 theta - mu) theta
        - hencky: U = lambda/2 theta^2
        - foam: U = 2 mu / (n^2 b) (exp(-n b theta) - 1), where n = 4 and b = nu / (1 - 2 nu)
        """
        lam, mu = lame_parameters(1.0, self.poisson)
        if self.name == "neo-hooke":
            return (0.5 * lam * theta - mu) * theta, lam * theta - mu, np.full_like(theta, lam)
        if self.name == "hencky":
            return 0.5 * lam * theta**2, lam * theta, np.full_like(theta, lam)
        n = FOAM_EXPONENT  # only the foam law remains
        b = self.poisson / (1.0 - 2.0 * self.poisson)
        if b == 0.0:  # the limit of the formulas below as b tends to 0
            return -2.0 * mu / n * theta, np.full_like(theta, -2.0 * mu / n), np.zeros_like(theta)
        power = np.exp(-n * b * theta)
        return 2.0 * mu / (n**2 * b) * (power - 1.0), -2.0 * mu / n * power, 2.0 * mu * b * power

"""What the step between two meshes does not see of a curve's error: sizes by tests/reference/fits/test_flat_punch.py.

They are fractions of the force over the linear one [1]. Each is the most over three laws, nu from 0.05 to 0.49 and
edges up to 0.07. For a sharp edge at nu < 0.3, the difference between the two meshes is larger than each of them.
"""

import math

import numpy as np

from reference.flat_punch.grid import fillet_elements
from reference.flat_punch.press import TipPress
from sensor.arrays import Floats

PENALTY = 2e-4  # against a penalty ten times as stiff
FAR_ELEMENTS = 1.1e-3  # against elements that grow by half as much from one to the next, on fillets
# Flesh that touches a fillet slides until its step ends and grips from there on: against steps of half the depth. The
# second is of the grip times how much wider than its seat the tip is.
STEPS = 4e-4
GRIP_OF_STEPS = 0.28


def unseen_error(press: TipPress, grip: float, depths: Floats) -> Floats:
    """Return the error [1] at depths [tip sides], of their shape, of a mesh that is not in its refinement.

    `grip` [1] is how much stiffer a tip that grips is than one that slides, at small strain.
    """
    tip = press.tip
    error = np.full_like(depths, PENALTY + FAR_ELEMENTS)
    if tip.edge == 0.0:
        return error
    of_grip = GRIP_OF_STEPS * (grip - 1.0) * tip.edge / tip.radius
    return error + (STEPS + of_grip)


def rim_error(press: TipPress, depths: Floats) -> Floats:
    """Return the relative error [1] at depths [tip sides] as the rim of the contact on a fillet lies between two nodes.

    Nodes are half an element apart. So the radius of the contact is off by up to a quarter of an element, and with it
    the slope of the force. This lasts until the next node touches. As the depth is proportional to covered^(3/2), that
    is over 3/2 (half an element / covered) of the depth, all of it at most.
    """
    tip = press.tip
    if tip.edge == 0.0:
        return np.zeros_like(depths)
    element = tip.edge / fillet_elements(tip.edge, press.refinement)
    slope_error = 0.25 * element / tip.radius
    share_of_depth = np.minimum(0.75 * element / fillet_covered(tip.radius, tip.edge, depths), 1.0)
    return slope_error * share_of_depth


def fillet_covered(radius: float, edge: float, depths: Floats) -> Floats:
    """Return how far a fillet is in contact [tip sides] at depths > 0 [tip sides], of their shape, at small strain.

    d = sqrt(8 radius) s^(3/2) / (3 edge). It holds for a fillet that is narrow against the radius, as a parabola, in I.
    N. Sneddon, Int. J. Eng. Sci. 3, 1965, doi 10.1016/0020-7225(65)90019-4.
    """
    return np.minimum((3.0 * edge * depths / math.sqrt(8.0 * radius)) ** (2.0 / 3.0), edge)


def fillet_loss(radius: float, edge: float, depths: Floats) -> Floats:
    """Return the fraction of a sharp tip's force that a fillet takes off [1] at depths > 0 [tip sides].

    At small strain the slope of the force is proportional to the radius of the contact. Its mean over the depth falls
    short of the tip's radius by edge - 3/5 of what is covered. Once all is covered, the force that is lost stays.
    """
    whole = math.sqrt(8.0 * radius * edge) / 3.0
    short = edge - 0.6 * fillet_covered(radius, edge, depths)
    return short / radius * np.minimum(whole / depths, 1.0)

"""The compliance and the mass of a ground steel pin that is glued into a foot."""

from cad.parts.housing import Pin
from sensor.design.processes import Process
from sensor.design.tips import Tips
from sensor.quantity import Estimate

STEEL_MPA = 206000.0  # Young's modulus, typical of carbon steel
STEEL_G_PER_CM3 = 7.85  # density, typical of carbon steel
GROUND_MM = 0.01  # typical tolerance of ground steel bars from dealers, which are not made to a fit
GLUE_SHEAR_MPA = 1100.0  # shear modulus of a hard epoxy with E = 3 GPa; plausible values are 2/3 to 2 times as large
_BONDED_SIDES = 3.0  # number of glued sides of a pin; there is no glue on the side of the pocket's gable
# A foot with a pin is more compliant than a foot that is loaded on its whole face. These values describe the difference
# times E side / (1 - nu^2) for all processes and for pins of 0.7 to 1.4 mm. The first value is the middle of the range,
# and the second is half its width. They were computed with solid models of a foot with glue and pin, and of a foot
# without a pocket.
FOOT_FACTOR = 0.01
FOOT_FACTOR_SPREAD = 0.08


def tip_accuracy_mm(tips: Tips, process: Process) -> float:
    """Return the tolerance (two sigma) of the side, the edges and the height of a tip, printed or ground [mm]."""
    return GROUND_MM if tips.socket == "pin" else process.accuracy_mm


def pin_compliance(pin: Pin, E: float, poisson: float) -> Estimate:
    """Return the additional compliance of a foot due to its glued pin [mm/N].

    `E` [MPa] and `poisson` [1] are the elastic constants of the foot. The compliance is the sum of three terms:

    - The protruding steel is a bar in compression, with the compliance l / (E_s A). Here l is its length, A its
      cross-sectional area, and E_s Young's modulus of steel.
    - The glue on three sides of the pin is a layer in shear, with the compliance t / (G A_g). Here t is its thickness,
      A_g its area, and G its shear modulus.
    - The foot deforms around the pin. The solution for the springs already contains a foot that is loaded on its whole
      face, so only the small difference is added here.

    A pin with a spherical end is treated as a cylinder. The error is half the compliance of the glue plus the spread of
    the third term.
    """
    side = pin.side  # side or diameter
    bar_compliance = pin.protruding_length / (STEEL_MPA * pin.square_area_ratio * side**2)
    glue_thickness = 0.5 * (pin.pocket_side - side)
    # The perimeters of a round and of a square pin have the same ratio as their areas.
    glue_compliance = glue_thickness / (
        GLUE_SHEAR_MPA * _BONDED_SIDES * pin.square_area_ratio * side * pin.pocket_depth
    )
    foot_compliance = (1.0 - poisson**2) / (E * side)
    return Estimate(
        value=bar_compliance + glue_compliance + FOOT_FACTOR * foot_compliance,
        error=0.5 * glue_compliance + FOOT_FACTOR_SPREAD * foot_compliance,
        unit="mm/N",
    )


def pin_mass(pin: Pin, density: float) -> float:
    """Return the mass that a glued pin adds to a foot [mg]: the steel of the pin minus the plastic of its pocket.

    `density` [g/cm^3] is the density of the foot.
    """
    area = pin.square_area_ratio * pin.side**2
    return area * (STEEL_G_PER_CM3 * pin.length - density * pin.pocket_depth)

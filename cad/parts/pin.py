"""The ground steel pin that is glued into a foot: its compliance and its mass."""

from cad.parts.housing import Pin
from sensor.design.processes import Process
from sensor.design.tips import Tips
from sensor.quantity import Estimate

STEEL_MPA = 206000.0  # modulus, typical of carbon steel
STEEL_G_PER_CM3 = 7.85  # density, typical of carbon steel
GROUND_MM = 0.01  # tolerance of ground steel bar from dealers: typical, not a fit
GLUE_SHEAR_MPA = 1100.0  # shear modulus of a hard epoxy with E = 3 GPa; possible values are 2/3 to 2 times as large
_BONDED_SIDES = 3.0  # number of glued sides of a pin; the gable of the pocket leaves the fourth side without glue
# The compliance that the foot around a pin has in addition to a foot loaded on its whole face, times
# E side / (1 - nu^2). The values are the middle and the half range over processes and pins of 0.7 to 1.4 mm. They are
# differences between solid models of foot, glue and pin, and of a foot without a pocket.
FOOT_GIVE = 0.01
FOOT_SPREAD = 0.08


def tip_accuracy_mm(tips: Tips, process: Process) -> float:
    """Return the tolerance (two sigma) of side, edge and height of a tip [mm], as printed or as a ground pin."""
    return GROUND_MM if tips.socket == "pin" else process.accuracy_mm


def pin_compliance(pin: Pin, E: float, poisson: float) -> Estimate:
    """Return the compliance of a pin relative to the foot in which it is glued [mm/N], for a foot of modulus E [MPa].

    The protruding steel is a bar in compression, and the glue a layer in shear on three sides of the pin. The solution
    for the springs contains the compliance of a foot loaded on its whole face; the small difference is added here. A
    pin with a spherical end is treated as a cylinder. The error is half the compliance of the glue and the range of the
    foot.
    """
    side = pin.side
    bar = pin.outside / (STEEL_MPA * pin.share_of_square * side**2)
    glue_thickness = 0.5 * (pin.pocket_side - side)
    glue = glue_thickness / (GLUE_SHEAR_MPA * _BONDED_SIDES * pin.share_of_square * side * pin.pocket_depth)
    foot = (1.0 - poisson**2) / (E * side)
    return Estimate(bar + glue + FOOT_GIVE * foot, 0.5 * glue + FOOT_SPREAD * foot, "mm/N")


def pin_mass(pin: Pin, density: float) -> float:
    """Return the mass that a glued pin adds to a foot [mg]: the steel of the pin minus the plastic of its pocket.

    `density` is that of the foot [g/cm^3].
    """
    area = pin.share_of_square * pin.side**2
    return area * (STEEL_G_PER_CM3 * pin.length - density * pin.pocket_depth)

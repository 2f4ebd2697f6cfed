"""The ground steel pin that is glued into a foot: how it gives way, and its mass."""

from cad.parts.housing import Pin
from sensor.design.processes import Process
from sensor.design.tips import Tips
from sensor.quantity import Estimate

STEEL_MPA = 206000.0  # modulus, typical of carbon steel
STEEL_G_PER_CM3 = 7.85  # likewise
GROUND_MM = 0.01  # by which ground steel bar is off, as dealers sell it: typical, not a fit
GLUE_SHEAR_MPA = 1100.0  # of a hard epoxy, E 3 GPa; two thirds of it to twice are taken as possible
_BONDED_SIDES = 3.0  # the gable leaves the fourth side of a pocket without glue
# What the foot gives around a pin, over that of its whole face, times E side / (1 - nu^2): middle and half range over
# processes and pins of 0.7 to 1.4 mm, by solids of foot, glue and pin less a solid foot.
FOOT_GIVE = 0.01
FOOT_SPREAD = 0.08


def tip_accuracy_mm(tips: Tips, process: Process) -> float:
    """Return the tolerance of a tip in side, edge and height [mm], two sigma: by its process, or as a ground pin."""
    return GROUND_MM if tips.socket == "pin" else process.accuracy_mm


def pin_compliance(pin: Pin, E: float, poisson: float) -> Estimate:
    """Return the compliance of a pin against the foot it is glued in [mm/N, E in MPa].

    The steel that stands out is a bar in compression, the glue a layer in shear on three sides of the pin. What the
    foot gives differs little from what its whole face would, which is in the solve of the springs. A ball at the end
    counts as a cylinder. The error holds half of what the glue gives and the range of the foot.
    """
    side = pin.side
    bar = pin.outside / (STEEL_MPA * pin.share_of_square * side**2)
    layer = 0.5 * (pin.pocket_side - side)
    glue = layer / (GLUE_SHEAR_MPA * _BONDED_SIDES * pin.share_of_square * side * pin.pocket_depth)
    foot = (1.0 - poisson**2) / (E * side)
    return Estimate(bar + glue + FOOT_GIVE * foot, 0.5 * glue + FOOT_SPREAD * foot, "mm/N")


def pin_mass(pin: Pin, density: float) -> float:
    """Return the mass of a glued pin less the mass that its pocket takes of the foot [mg from g/cm^3]."""
    area = pin.share_of_square * pin.side**2
    return area * (STEEL_G_PER_CM3 * pin.length - density * pin.pocket_depth)

"""The test bench for the calibration of a unit: a balance and a dial, whose resolutions limit its accuracy."""

from dataclasses import dataclass

from sensor.design.processes import Process
from sensor.quantity import Bounds, check_fields, quantity, validation_error

RUBBER_POISSON = 0.5  # Poisson's ratio of a reference ball made of rubber
_GLASS_MPA = 70e3 / (1.0 - 0.2**2)  # E / (1 - nu^2) of float glass: EN 572-1
_DIGIT = Bounds(at_least=1e-6, at_most=100.0)
_LOAD = Bounds(at_least=0.1, at_most=1e5)
PRESSED = 0.9
"""Maximum force or deflection in a calibration, as a fraction of the maximum that the spring has in use."""
WEIGHED_AT = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
"""Weights as fractions of the largest weight. Unloading in the same steps would only repeat the rounding errors."""
PLATE_AT = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Deflections on a plate as fractions of the largest deflection. All tips already touch the plate at the first one."""


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A balance with its resolution and its maximum load [g], and a dial with its resolution [mm].

    The defaults are a pocket balance and a dial indicator, which cost less than 100 euros together. Balances with a
    resolution of 0.001 g cost 50 to 100 pounds (quicktest.co.uk, Weights and weighing machines). Dial indicators cost
    40 dollars and more (gearprism.com, Dial Indicator Guide).
    """

    balance_g: float = quantity(
        "g",
        _DIGIT,
        default=0.01,
        hint="a pocket balance for jewellery has 0.01",
        meaning="resolution of the balance; the default is a pocket balance for jewellery",
    )
    balance_max_g: float = quantity(
        "g",
        _LOAD,
        default=200.0,
        hint="a pocket balance for jewellery has 200",
        meaning="maximum load of the balance",
    )
    dial_mm: float = quantity(
        "mm",
        _DIGIT,
        default=0.01,
        hint="a dial indicator has 0.01",
        meaning="resolution of the dial that measures deflections and travels; the default is a dial indicator",
    )

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, or if the resolution of the balance is not below its maximum load."""
        check_fields(self, "bench")
        if not self.balance_g < self.balance_max_g:
            bound = f"less than bench.balance_max_g = {self.balance_max_g:g} g"
            raise validation_error("bench.balance_g", self.balance_g, "g", bound, "check the units of both keys")


def modulus_on_glass(process: Process) -> float:
    """Return the reduced modulus [MPa] of the contact between a printed tip and a glass plate."""
    return 1.0 / ((1.0 - process.poisson**2) / process.E_MPa + 1.0 / _GLASS_MPA)

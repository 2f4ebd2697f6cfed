"""Full bridges of foil gauges on the springs, and the amplifier that reads them: output, excitation, noise.

Excitation: Vishay Measurements Group, Tech Note TN-502: a bridge of equal arms whose grids may give off p of power per
area takes V = 2 sqrt(R p A).
"""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.design.processes import Process
from cad.parts.housing import Housing
from cad.theory.leaf_spring import Flexure, gauge_strain
from cad.theory.strain_gauge import FOIL, shortest_gauged

_DATA = tomllib.loads(Path(__file__).with_name("electronics.toml").read_text(encoding="utf-8"))
AMPLIFIER = _DATA["amplifier"]
_BRIDGE = _DATA["bridge"]
RESISTANCE_OHM: float = _BRIDGE["resistance_ohm"]
_METAL_MPA = 2e4  # a modulus beyond that of any plastic
_E96 = 96  # values of a decade, three digits each
_LEAST_OUTPUT = 0.1  # [mV/V] at full force: below it 1 % of it is lost in drift of a few microvolts per volt


@dataclass(frozen=True, kw_only=True)
class Spring:
    """What a read-out must know of a spring: its leaves, K [N/mm], and its largest deflection [mm]."""

    name: str
    flexure: Flexure
    K: float
    deflection: float
    strain_per_N: float | None = None

    @property
    def force(self) -> float:
        """Return the largest force [N]."""
        return self.K * self.deflection


@dataclass(frozen=True, kw_only=True)
class Bridge:
    """The full bridge of a spring: output [mV/V per N], at full force [mV/V], noise of a force [mN]; None where short.

    The output is that of the solve with gauges where they are glued on, else the beam law's without their stiffening.
    """

    name: str
    force: float
    deflection: float
    output: float | None
    noise_mN: float | None

    @property
    def full_output(self) -> float | None:
        """Return the output at the largest force [mV/V]."""
        return None if self.output is None else self.output * self.force

    @property
    def fits(self) -> bool:
        """Say whether gauges have room on the leaf and tell its force."""
        return self.full_output is not None and self.full_output >= _LEAST_OUTPUT


def largest_excitation(process: Process) -> float:
    """Return the largest voltage across a bridge [V] that keeps its zero steady on this material."""
    power = _BRIDGE["metal_mW_per_mm2" if process.E_MPa > _METAL_MPA else "plastic_mW_per_mm2"]
    area = FOIL.grid_length_mm * FOIL.grid_width_mm
    return min(float(AMPLIFIER["supply_V"]), 2.0 * math.sqrt(1e-3 * RESISTANCE_OHM * power * area))


def series_resistor(process: Process) -> float:
    """Return the resistor [ohm] in each of the two supply wires of a bridge: the least of series E96 that is enough.

    None is needed, 0, where the bridge bears the whole supply.
    """
    least = 0.5 * RESISTANCE_OHM * (float(AMPLIFIER["supply_V"]) / largest_excitation(process) - 1.0)
    if least <= 0.0:
        return 0.0
    decade = 10.0 ** (math.floor(math.log10(least)) - 2)
    values: list[float] = [decade * round(100.0 * 10.0 ** (step / _E96)) for step in range(_E96 + 1)]  # IEC 60063
    return next(value for value in values if value >= least)


def excitation(process: Process) -> float:
    """Return the voltage across a bridge [V] behind its two resistors."""
    return float(AMPLIFIER["supply_V"]) * RESISTANCE_OHM / (RESISTANCE_OHM + 2.0 * series_resistor(process))


def bridges(springs: Sequence[Spring], housing: Housing, process: Process) -> tuple[Bridge, ...]:
    """Return the bridge of every spring; raises ValueError for a grid longer than half a leaf."""
    return tuple(_bridge(spring, housing, process) for spring in springs)


def _bridge(spring: Spring, housing: Housing, process: Process) -> Bridge:
    flexure = spring.flexure
    room = flexure.length >= shortest_gauged(flexure.fillet, FOIL) and flexure.depth >= FOIL.backing_width_mm
    output = noise = None
    if housing.gauges != "none" or room:
        strain = spring.strain_per_N
        if strain is None:
            strain = gauge_strain(flexure.thickness, flexure.length, 1.0 / spring.K, FOIL.grid_length_mm)
        output = 1e3 * FOIL.gauge_factor * strain
        noise = 1e-3 * AMPLIFIER["noise_nV"] / (output * excitation(process))
    return Bridge(name=spring.name, force=spring.force, deflection=spring.deflection, output=output, noise_mN=noise)

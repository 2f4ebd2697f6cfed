"""Tables of a calibration bench: readings of a unit under weights and on a hard plate, and its reference ball."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from instrument.press.signals import count_keys
from instrument.simulate.drawn_fruit import PressedFruit, designed_radii, range_of_moduli
from instrument.simulate.unit import SimulatedUnit
from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.design.bench import PLATE_AT, PRESSED, RUBBER_POISSON, WEIGHED_AT, Bench, modulus_on_glass
from sensor.quantity import STANDARD_GRAVITY

G_PER_N = 1e3 / STANDARD_GRAVITY
BALL_PRESSES = 3
_LEAST_RADIUS = 3.5  # least radius of a ball over the spacing of the tips; a smaller ball feels its far side
_ROUNDS = 20  # iterations of the flattening of a dome, which reduces its force


def weights_table(report: Report, unit: SimulatedUnit, bench: Bench, rng: np.random.Generator) -> list[str]:
    """Return a table of weights, with dial and channels, up to nearly the full scale of each tip and back.

    A weight is known to the digit of the balance, and is read at the time for which the unit's stiffnesses hold.
    """
    lines = [",".join(["tip", "weight_g", "deflection_mm", *count_keys(len(report.tips))])]
    for number, (tip, full_scale) in enumerate(zip(report.tips, report.read_out.full_scale_N, strict=True)):
        most = min(PRESSED * full_scale * G_PER_N, bench.balance_max_g)
        written = [_rounded(part * most, bench.balance_g) for part in WEIGHED_AT]
        true = [0.0 if not part else _within(grams, bench.balance_g, rng) for part, grams in enumerate(written)]
        for step in _there_and_back(len(written)):
            deflections = np.zeros(len(report.tips))
            deflections[number] = true[step] / G_PER_N / unit.domes.K[number]
            dial = _written(float(deflections[number]), bench.dial_mm)
            weight = _written(written[step], bench.balance_g)
            lines.append(",".join([tip.name, weight, dial, *_counts(unit, deflections, rng)]))
    return lines


def plate_table(report: Report, unit: SimulatedUnit, bench: Bench, rng: np.random.Generator) -> list[str]:
    """Return a table of travels on a glass plate with all tips in contact, up to nearly one full scale and back."""
    tips = len(report.tips)
    nominal = 1.0 / np.diag(report.read_out.springs_mm_per_N)
    farthest = PRESSED * float(min(np.array(report.read_out.full_scale_N) / nominal))
    lines = [",".join(["travel_mm", *count_keys(tips)])]
    # The travel is counted from a place at which all tips stand on the plate.
    ahead = unit.heights - unit.heights.min()
    for step in _there_and_back(len(PLATE_AT)):
        travel = PLATE_AT[step] * farthest
        deflections = _on_glass(report, unit.domes.K, travel + ahead)
        lines.append(",".join([_written(travel, bench.dial_mm), *_counts(unit, deflections, rng)]))
    return lines


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A ball of rubber: its modulus [MPa] and its radius [mm]."""

    E: float
    radius: float

    @property
    def reduced(self) -> float:
        """Return E / (1 - nu^2) [MPa]."""
        return self.E / (1.0 - RUBBER_POISSON**2)

    def fruit(self, tilt: tuple[float, float] = (0.0, 0.0)) -> PressedFruit:
        """Return the ball as a pressed fruit, with the sensor tilted by angles [deg]."""
        return PressedFruit(
            E=self.E,
            radii=(self.radius, self.radius),
            azimuth=0.0,
            thickness=None,
            poisson=RUBBER_POISSON,
            tilt=tilt,
        )


def usual_ball(report: Report) -> Ball:
    """Return a ball with the curvature of a design's fruit, which responds as flesh of the middle of its moduli."""
    first, second = designed_radii(report)
    radius = 2.0 / (1.0 / first + 1.0 / second)
    least, largest = range_of_moduli(report)
    E = math.sqrt(least * largest) * (1.0 - RUBBER_POISSON**2) / (1.0 - report.design.fruit.poisson**2)
    return Ball(E=E, radius=max(radius, _LEAST_RADIUS * report.design.tips.spacing_mm))


def ball_presses(ball: Ball, steepest_deg: float, rng: np.random.Generator) -> Sequence[PressedFruit]:
    """Return presses on a ball by a hand that tilts by at most an angle [deg]."""
    tilts = rng.uniform(-1.0, 1.0, (BALL_PRESSES, 2)) * steepest_deg / math.sqrt(2.0)
    return [ball.fruit((along, across)) for along, across in tilts.tolist()]


def _on_glass(report: Report, K: Floats, travels: Floats) -> Floats:
    """Return the deflections of springs [mm] whose tips move by travels [mm]; domes flatten by Hertz's law."""
    reduced, radius = modulus_on_glass(report.design.process), report.design.tips.dome_radius_mm or math.inf
    deflections = travels
    for _ in range(_ROUNDS):
        flattened = (9.0 * (K * deflections) ** 2 / (16.0 * reduced**2 * radius)) ** (1.0 / 3.0)
        deflections = np.maximum(travels - flattened, 0.0)
    return deflections


def _counts(unit: SimulatedUnit, deflections: Floats, rng: np.random.Generator) -> list[str]:
    """Return the noisy counts of the channels for deflections [mm] in one sample."""
    shown = unit.shown(deflections[None])[0] + unit.noise * rng.normal(size=len(deflections))
    return [str(count) for count in np.rint(shown).astype(int).tolist()]


def _there_and_back(steps: int) -> list[int]:
    return [*range(steps), *range(steps - 2, -1, -1)]


def _rounded(value: float, digit: float) -> float:
    return digit * round(value / digit)


def _within(value: float, digit: float, rng: np.random.Generator) -> float:
    """Return a random number that rounds to `value` at a digit."""
    return value + digit * float(rng.uniform(-0.5, 0.5))


def _written(value: float, digit: float) -> str:
    """Return a number as text with the decimals of a digit."""
    return f"{_rounded(value, digit):.{max(0, math.ceil(-math.log10(digit) - 1e-9))}f}"

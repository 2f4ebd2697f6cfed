"""Simulate the tables of a calibration with weights or on a hard plate, and choose a reference ball for a design."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from instrument.press.signals import count_keys
from instrument.simulate.drawn_fruit import PressedFruit, range_of_moduli
from instrument.simulate.unit import SimulatedUnit
from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.design.bench import PLATE_AT, PRESSED, RUBBER_POISSON, WEIGHED_AT, Bench, modulus_on_glass
from sensor.design.radius_ranges import designed_radii
from sensor.quantity import STANDARD_GRAVITY

G_PER_N = 1e3 / STANDARD_GRAVITY  # mass of a weight per force [g/N]
BALL_PRESSES = 3  # number of presses on a reference ball
_MIN_RADIUS_IN_SPACINGS = 3.5
"""Minimum radius of a ball, in tip spacings [1]; a press is affected by the far side of a smaller ball."""
_MAX_ITERATIONS = 20  # number of iterations for the flattening of a dome, which reduces its force


def weights_table(report: Report, unit: SimulatedUnit, bench: Bench, rng: np.random.Generator) -> list[str]:
    """Return the lines of a table of weights with the readings of a dial indicator and the counts.

    On each tip of the `unit` in turn, weights are hung up to nearly its full scale and then removed again. `bench`
    states the resolutions of balance and dial indicator. Creep between hanging and reading a weight is not simulated,
    because the stiffnesses of the unit hold for the time of the reading. The counts have noise, which `rng` draws.
    """
    lines = [",".join(["tip", "weight_g", "deflection_mm", *count_keys(len(report.tips))])]
    for tip_index, (tip, full_scale) in enumerate(zip(report.tips, report.read_out.full_scale_N, strict=True)):
        largest_weight = min(PRESSED * full_scale * G_PER_N, bench.balance_max_g)  # [g]
        weighed = [_round(fraction * largest_weight, bench.balance_g) for fraction in WEIGHED_AT]  # balance readings
        # Step 0 has no weight, so its force is exactly 0.
        true_weights = [0.0, *(_draw_before_rounding(grams, bench.balance_g, rng) for grams in weighed[1:])]
        for step in _up_and_down(len(weighed)):
            deflections = np.zeros(len(report.tips))  # only the loaded spring is deflected
            deflections[tip_index] = true_weights[step] / G_PER_N / unit.domes.K[tip_index]
            dial_reading = _format(float(deflections[tip_index]), bench.dial_mm)
            balance_reading = _format(weighed[step], bench.balance_g)
            lines.append(",".join([tip.name, balance_reading, dial_reading, *_counts(unit, deflections, rng)]))
    return lines


def plate_table(report: Report, unit: SimulatedUnit, bench: Bench, rng: np.random.Generator) -> list[str]:
    """Return the lines of a table of travels on a glass plate, with the counts of all channels.

    All tips are in contact. The travel increases until one of the tips is close to its full scale, and decreases again.
    `bench` states the resolution of the dial indicator. The counts have noise, which `rng` draws.
    """
    tips = len(report.tips)
    nominal_K = 1.0 / np.diag(report.read_out.springs_mm_per_N)  # [N/mm]
    largest_travel = PRESSED * float(min(np.array(report.read_out.full_scale_N) / nominal_K))
    lines = [",".join(["travel_mm", *count_keys(tips)])]
    # The travel is counted from the touch of the last tip. Tips that protrude more have already travelled by then.
    initial_travels = unit.heights - unit.heights.min()
    for step in _up_and_down(len(PLATE_AT)):
        travel = PLATE_AT[step] * largest_travel
        deflections = _deflections_on_glass(report, unit.domes.K, travel + initial_travels)
        lines.append(",".join([_format(travel, bench.dial_mm), *_counts(unit, deflections, rng)]))
    return lines


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A rubber ball with the modulus E [MPa] and its radius [mm]."""

    E: float
    radius: float

    @property
    def reduced(self) -> float:
        """Return E / (1 - nu^2) [MPa]."""
        return self.E / (1.0 - RUBBER_POISSON**2)

    def fruit(self, tilt: tuple[float, float] = (0.0, 0.0)) -> PressedFruit:
        """Return the ball as a fruit, pressed by a sensor that is tilted by `tilt` along x and y [deg]."""
        return PressedFruit(
            E=self.E,
            radii=(self.radius, self.radius),
            azimuth=0.0,
            thickness=None,
            poisson=RUBBER_POISSON,
            tilt=tilt,
        )


def usual_ball(report: Report) -> Ball:
    """Return a rubber ball that resembles the fruit of a design.

    The ball has the mean curvature of the fruit, or the smallest allowed radius. Its E / (1 - nu^2) equals the value
    for flesh whose modulus is the geometric mean of the design's range.
    """
    first, second = designed_radii(report.design)
    radius = 2.0 / (1.0 / first + 1.0 / second)
    softest, firmest = range_of_moduli(report)
    E = math.sqrt(softest * firmest) * (1.0 - RUBBER_POISSON**2) / (1.0 - report.design.fruit.poisson**2)
    return Ball(E=E, radius=max(radius, _MIN_RADIUS_IN_SPACINGS * report.design.tips.spacing_mm))


def ball_presses(ball: Ball, steepest_deg: float, rng: np.random.Generator) -> Sequence[PressedFruit]:
    """Return presses on a ball with random tilts of at most `steepest_deg` [deg]."""
    # Each of the two components is at most the largest tilt divided by the square root of 2.
    tilts = rng.uniform(-1.0, 1.0, (BALL_PRESSES, 2)) * steepest_deg / math.sqrt(2.0)
    return [ball.fruit((along, across)) for along, across in tilts.tolist()]


def _deflections_on_glass(report: Report, K: Floats, travels: Floats) -> Floats:
    """Return the deflections (tips,) [mm] of springs of stiffness K (tips,) [N/mm] whose tips are pressed on glass.

    `travels` (tips,) [mm] are the travels from the touch of each tip. The deflection d of a spring is its travel x
    minus the flattening of its dome by Hertz's law,

        d = x - (9 (K d)^2 / (16 E*^2 R))^(1/3),

    with the reduced modulus E* [MPa] of dome and glass, and the dome radius R [mm]. Tips without a dome do not flatten.
    """
    reduced, radius = modulus_on_glass(report.design.process), report.design.tips.dome_radius_mm or math.inf
    deflections = travels
    # The fixed-point iteration converges quickly, because a dome flattens much less than its spring deflects.
    for _ in range(_MAX_ITERATIONS):
        flattened = (9.0 * (K * deflections) ** 2 / (16.0 * reduced**2 * radius)) ** (1.0 / 3.0)
        deflections = np.maximum(travels - flattened, 0.0)
    return deflections


def _counts(unit: SimulatedUnit, deflections: Floats, rng: np.random.Generator) -> list[str]:
    """Return the counts of all channels with noise, as text, for deflections (tips,) [mm]."""
    noise = unit.noise * rng.normal(size=len(deflections))
    signals = unit.signals(deflections[None])[0] + noise  # `signals` takes an array of samples
    return [str(count) for count in np.rint(signals).astype(int).tolist()]


def _up_and_down(steps: int) -> list[int]:
    """Return the indices from 0 to `steps` - 1 and back to 0."""
    return [*range(steps), *range(steps - 2, -1, -1)]


def _round(value: float, resolution: float) -> float:
    """Return the multiple of the resolution that is nearest to the value."""
    return resolution * round(value / resolution)


def _draw_before_rounding(value: float, resolution: float, rng: np.random.Generator) -> float:
    """Return a random true value that an instrument with this resolution shows as `value`."""
    return value + resolution * float(rng.uniform(-0.5, 0.5))


def _format(value: float, resolution: float) -> str:
    """Return a number as text, rounded to the resolution and with as many decimals as the resolution has."""
    # The small number keeps round-off in the logarithm from adding a decimal.
    decimals = max(0, math.ceil(-math.log10(resolution) - 1e-9))
    return f"{_round(value, resolution):.{decimals}f}"

"""The signal path of a sensor, from the forces of its springs to counts: sensitivity, noise and drift."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from sensor.design.bench import Bench
from sensor.design.processes import Process
from sensor.design.readout import PROBE, Readout
from sensor.quantity import UNIFORM_DEVIATION, report_field


@dataclass(frozen=True, kw_only=True)
class SpringToRead:
    """The properties of a spring that a read-out needs: its stiffness `K` [N/mm] and its largest deflection [mm].

    The deflection is that of the two-spring law for which the stops are placed. A press on the fruit bends a spring by
    slightly less.
    """

    name: str
    K: float
    deflection: float

    @property
    def force(self) -> float:
        """Return the force of the spring at its largest deflection [N]."""
        return self.K * self.deflection


@dataclass(frozen=True, kw_only=True)
class SignalPath:
    """The conversion of forces to counts. Lists are in the order of the tips, and fields are keys of report.json.

    Drifts are upper limits for the temperature changes in [readout].
    """

    amplifier: str = report_field("", "name of the amplifier")
    board: str = report_field("", "name of the microcontroller board")
    rate_Hz: float = report_field("Hz", "sample rate of each channel")
    excitation_V: float = report_field("V", "supply voltage of the Hall sensors")
    saturation_counts: int = report_field("1", "counts at which a channel saturates")
    full_counts: tuple[float, ...] = report_field(
        "1", "counts of each channel at its largest force; empty until the presses are solved", default=()
    )
    counts_per_N: tuple[float, ...] = report_field("1/N", "sensitivity of each channel")
    noise_N: tuple[float, ...] = report_field("N", "noise of a sample, one standard deviation")
    zero_drift_N: tuple[float, ...] = report_field("N", "largest zero drift of each channel since the last taring")
    gain_drift_percent: tuple[float, ...] = report_field("%", "largest gain drift of each channel since calibration")
    modulus_drift_percent: float = report_field(
        "%", "largest common drift of all forces since calibration, caused by the modulus of the leaves"
    )
    delay_ms: tuple[float, ...] = report_field(
        "ms",
        "delay of the conversion of each channel after the conversion of the first channel; empty if all channels are "
        "converted at once",
    )
    time_error_ms: float = report_field("ms", "largest error of a conversion time, in addition to `delay_ms`")

    def with_full_scale(self, forces_N: Sequence[float]) -> "SignalPath":
        """Return a copy with the counts at the largest force [N] of each tip."""
        pairs = zip(self.counts_per_N, forces_N, strict=True)
        return replace(self, full_counts=tuple(counts * force for counts, force in pairs))

    @property
    def rounding_N(self) -> tuple[float, ...]:
        """Return the standard deviation of the force of each tip [N] caused by rounding to whole counts.

        The rounding error is distributed uniformly within one count (JCGM 100:2008, F.2.2.1).
        """
        return tuple(1.0 / counts / math.sqrt(12.0) for counts in self.counts_per_N)

    @property
    def noises_N(self) -> tuple[float, ...]:
        """Return the standard deviation of a sample of each tip [N], due to noise and to rounding to whole counts."""
        return tuple(math.hypot(noise, rounding) for noise, rounding in zip(self.noise_N, self.rounding_N, strict=True))

    @property
    def delays(self) -> tuple[float, ...]:
        """Return the delay of each channel as a fraction of the sample period [1], or () if there are no delays."""
        return tuple(1e-3 * self.rate_Hz * delay for delay in self.delay_ms) if any(self.delay_ms) else ()

    @property
    def time_deviation(self) -> float:
        """Return the standard deviation of the sampling time of a channel, as a fraction of the sample period [1].

        The timing error is assumed to be uniformly distributed between its bounds (JCGM 100:2008, 4.3.7).
        """
        return UNIFORM_DEVIATION * 1e-3 * self.rate_Hz * self.time_error_ms

    @property
    def conversion_order(self) -> tuple[int, ...]:
        """Return the indices of the channels, starting at 0, in the order of their conversions.

        Channels that are converted at the same time are in the order of the tips.
        """
        channels = range(len(self.counts_per_N))
        if not self.delay_ms:  # all channels are converted at once
            return tuple(channels)
        return tuple(sorted(channels, key=lambda channel: self.delay_ms[channel]))

    @property
    def errors_N(self) -> tuple[float, ...]:
        """Return the force error of each unloaded tip [N], caused by noise and by the zero drift."""
        return tuple(math.hypot(noise, zero) for noise, zero in zip(self.noises_N, self.zero_drift_N, strict=True))


@dataclass(frozen=True, kw_only=True)
class SpringReadOut:
    """The springs of a sensor, and their read-out if the design has one.

    `bench` is the bench that will calibrate the springs, or None if the design needs no calibration. `fastest_s` is the
    shortest duration of a press by hand [s] that the signal path can follow, or None if it is unknown. `folder` is the
    name of the folder of the report in printed commands. `presses` is the number of presses that are read as one fruit.
    `height_difference_down` [mm] is the height difference of the tips that weight causes if the sensor points down.
    """

    springs: Sequence[SpringToRead]
    signal: SignalPath | None = None
    bench: Bench | None = None
    fastest_s: float | None = None
    folder: str = "OUT"
    presses: int = 1
    height_difference_down: float = 0.0


def balanced_order(kinds: Sequence[str]) -> tuple[int, ...]:
    """Return an order of conversion in which the channels of both kinds of springs have the same mean sampling time.

    `kinds` is the kind of the spring of each tip, "low" or "high". The order lists the indices of the tips. If one kind
    has an even number of channels, half of them come before the other kind and half after it. An example is low, high,
    high, low. The effect of the delays on the contrast then cancels on a level sensor. A pair has no such order, so it
    keeps the order of its tips.
    """
    even_kinds = [kind for kind in dict.fromkeys(kinds) if kinds.count(kind) % 2 == 0]
    if not even_kinds:
        return tuple(range(len(kinds)))
    outer_kind = even_kinds[0]
    outer = [tip for tip, kind in enumerate(kinds) if kind == outer_kind]
    inner = [tip for tip, kind in enumerate(kinds) if kind != outer_kind]
    half = len(outer) // 2
    return (*outer[:half], *inner, *outer[half:])


def channel_delays(readout: Readout, kinds: Sequence[str]) -> tuple[float, ...]:
    """Return the delay [ms] of each channel after the first conversion of a sample, in the order of the tips.

    `kinds` is the kind of the spring of each tip, "low" or "high". If the design does not give the delays, each
    amplifier converts all its inputs one after the other during a sample period.
    """
    amplifier = readout.circuit
    if readout.delay_ms is not None:
        return readout.delay_ms
    inputs = int(amplifier.channels)
    order = balanced_order(kinds)
    sample_period_ms = 1e3 / amplifier.rate_Hz
    # Several amplifiers convert at the same time, so the position of a channel is counted within its amplifier.
    positions = [order.index(tip) % inputs for tip in range(len(kinds))]
    return tuple(sample_period_ms * position / inputs for position in positions)


class _InputSignal(NamedTuple):
    """The signal at the input of the amplifier: its sensitivity, its noise (one standard deviation), and its drifts."""

    V_per_mm: float
    noise_V: float
    zero_drift_V: float
    gain_drift_percent: float


def _input_signal(readout: Readout) -> _InputSignal:
    """Return the signal of a displacement sensor at the input of the amplifier, with the errors of both.

    The amplifier and the displacement sensor have independent errors, so their squares add.
    """
    # The factor 1e-3 converts mV to V and um to mm, 1e-4 converts ppm to per cent, and 1e-9 converts nV to V.
    amplifier = readout.circuit
    V_per_mm = 1e-3 * (readout.sensitivity_mV_per_mm or PROBE.sensitivity_mV_per_mm)
    noise_um = PROBE.noise_um if readout.noise_um is None else readout.noise_um
    noise_V = math.hypot(1e-9 * amplifier.noise_nV, 1e-3 * noise_um * V_per_mm)
    probe_zero_V = 1e-3 * math.hypot(PROBE.zero_um_per_K * readout.tare_K, PROBE.zero_um) * V_per_mm
    zero_V = math.hypot(1e-9 * amplifier.offset_nV_per_K * readout.tare_K, probe_zero_V)
    # The zero drifts from the last taring on, and the gain from the calibration on.
    probe_gain_percent = math.hypot(PROBE.gain_percent_per_K * readout.drift_K, PROBE.linearity_percent)
    gain_percent = math.hypot(1e-4 * amplifier.gain_ppm_per_K * readout.drift_K, probe_gain_percent)
    return _InputSignal(V_per_mm=V_per_mm, noise_V=noise_V, zero_drift_V=zero_V, gain_drift_percent=gain_percent)


class _Channel(NamedTuple):
    """The properties of a channel, which are the same for all tips on one kind of spring.

    The noise is one standard deviation, and the zero drift is the largest drift since the last taring.
    """

    counts_per_N: float
    noise_N: float
    zero_drift_N: float


def signal_path(
    readout: Readout, springs: Sequence[SpringToRead], process: Process, kinds: Sequence[str]
) -> SignalPath:
    """Return the signal path of a sensor: the sensitivity, the noise and the drift of the channel of each tip.

    `springs` has one entry for each kind of spring, and `kinds` is the kind of the spring of each tip, "low" or "high".
    Each spring has the standard displacement sensor, except for the numbers that `readout` overrides. The drifts hold
    for the temperature changes given in `readout`. The stiffness of the springs drifts with the modulus of the
    `process`.
    """
    amplifier = readout.circuit
    signal = _input_signal(readout)
    channel_of_kind = {}
    for spring in springs:
        V_per_N = signal.V_per_mm / spring.K
        counts_per_N = V_per_N * amplifier.counts_per_V
        channel_of_kind[spring.name] = _Channel(
            counts_per_N=counts_per_N,
            noise_N=signal.noise_V / V_per_N,
            zero_drift_N=signal.zero_drift_V / V_per_N,
        )
    channels = [channel_of_kind[kind] for kind in kinds]  # in the order of the tips
    return SignalPath(
        amplifier=amplifier.name,
        board=readout.board,
        rate_Hz=amplifier.rate_Hz,
        excitation_V=amplifier.supply_V,
        saturation_counts=amplifier.saturation,
        counts_per_N=tuple(channel.counts_per_N for channel in channels),
        noise_N=tuple(channel.noise_N for channel in channels),
        zero_drift_N=tuple(channel.zero_drift_N for channel in channels),
        gain_drift_percent=(signal.gain_drift_percent,) * len(kinds),
        modulus_drift_percent=100.0 * abs(process.E_per_K or 0.0) * readout.drift_K,
        delay_ms=channel_delays(readout, kinds),
        time_error_ms=readout.largest_time_error_ms,
    )

"""Full bridges of foil gauges on the springs, and the signal path of a sensor: output, excitation, noise, drift.

Excitation: Vishay Measurements Group, Tech Note TN-502. A bridge of equal arms whose grids may give off p of power per
area takes V = 2 sqrt(R p A).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sensor.design.processes import Process
from sensor.design.readout import AMPLIFIERS, BRIDGE, PROBE, Amplifier, Readout
from sensor.quantity import BOUNDED, report_field
from sensor.theory.leaf_spring import Flexure, gauge_strain
from sensor.theory.strain_gauge import FOIL, shortest_gauged

HX711 = AMPLIFIERS["HX711"]
RESISTANCE_OHM = BRIDGE.resistance_ohm
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

    @property
    def bridge_output(self) -> float:
        """Return the output of a full bridge of gauges [mV/V per N]; raises ValueError for a grid too long for a leaf.

        It is that of the solve with gauges where they are glued on, else the beam law's without their stiffening.
        """
        strain = self.strain_per_N
        if strain is None:
            flexure = self.flexure
            strain = gauge_strain(flexure.thickness, flexure.length, 1.0 / self.K, FOIL.grid_length_mm)
        return 1e3 * FOIL.gauge_factor * strain

    @property
    def has_room(self) -> bool:
        """Say whether gauges have room on the leaf."""
        flexure = self.flexure
        return flexure.length >= shortest_gauged(flexure.fillet, FOIL) and flexure.depth >= FOIL.backing_width_mm

    @property
    def suits_gauges(self) -> bool:
        """Say whether gauges have room on the leaf and tell its force."""
        return self.has_room and self.bridge_output * self.force >= _LEAST_OUTPUT


def largest_excitation(process: Process, amplifier: Amplifier = HX711) -> float:
    """Return the largest voltage across a bridge [V] that keeps its zero steady on this material."""
    power = BRIDGE.metal_mW_per_mm2 if process.E_MPa > _METAL_MPA else BRIDGE.plastic_mW_per_mm2
    area = FOIL.grid_length_mm * FOIL.grid_width_mm
    return min(amplifier.supply_V, 2.0 * math.sqrt(1e-3 * RESISTANCE_OHM * power * area))


def series_resistor(process: Process, amplifier: Amplifier = HX711) -> float:
    """Return the resistor [ohm] in each of the two supply wires of a bridge: the least of series E96 that is enough.

    None is needed, 0, where the bridge bears the whole supply.
    """
    least = 0.5 * RESISTANCE_OHM * (amplifier.supply_V / largest_excitation(process, amplifier) - 1.0)
    if least <= 0.0:
        return 0.0
    decade = 10.0 ** (math.floor(math.log10(least)) - 2)
    values: list[float] = [decade * round(100.0 * 10.0 ** (step / _E96)) for step in range(_E96 + 1)]  # IEC 60063
    return next(value for value in values if value >= least)


def excitation(process: Process, amplifier: Amplifier = HX711) -> float:
    """Return the voltage across a bridge [V] behind its two resistors."""
    return amplifier.supply_V * RESISTANCE_OHM / (RESISTANCE_OHM + 2.0 * series_resistor(process, amplifier))


@dataclass(frozen=True, kw_only=True)
class SignalPath:
    """What becomes of forces on the way to counts, each list in the order of the tips; fields are keys of report.json.

    Drifts are bounds, after a change of the temperature as [readout] allows.
    """

    transducer: str = report_field("", "transducer of the force: `foil` gauges, or a sensor of `displacement`")
    amplifier: str = report_field("", "name of the amplifier")
    board: str = report_field("", "name of the microcontroller board")
    rate_Hz: float = report_field("Hz", "sample rate of each channel")
    excitation_V: float = report_field("V", "supply voltage of the transducer")
    saturation_counts: int = report_field("1", "counts at which a channel saturates")
    mV_per_V: tuple[float, ...] = report_field(
        "mV/V", "output of each bridge at its largest force; empty for a displacement sensor"
    )
    full_counts: tuple[float, ...] = report_field("1", "counts of each channel at its largest force")
    counts_per_N: tuple[float, ...] = report_field("1/N", "sensitivity of each channel")
    noise_N: tuple[float, ...] = report_field("N", "noise of a sample, one standard deviation")
    zero_drift_N: tuple[float, ...] = report_field("N", "largest drift of each zero since the last taring")
    gain_drift_percent: tuple[float, ...] = report_field("%", "largest drift of each gain since the calibration")
    modulus_drift_percent: float = report_field(
        "%", "largest common drift of all forces since the calibration, from the modulus of the leaves"
    )
    self_heating_K: float = report_field("K", "largest temperature rise of a leaf by its gauges")
    self_heating_percent: float = report_field("%", "change of the leaf's modulus by that temperature rise")
    delay_ms: tuple[float, ...] = report_field(
        "ms",
        "delay of the conversion of each channel after the first channel of the sample; empty if all are "
        "converted at once",
    )
    time_error_ms: float = report_field("ms", "bound of the error of a conversion time, in addition to `delay_ms`")

    @property
    def quanta_N(self) -> tuple[float, ...]:
        """Return the force of one count of each tip [N]."""
        return tuple(1.0 / counts for counts in self.counts_per_N)

    @property
    def noises_N(self) -> tuple[float, ...]:
        """Return the standard deviation of a sample of each tip [N]: its noise, and its rounding to whole counts."""
        rows = zip(self.noise_N, self.quanta_N, strict=True)
        return tuple(math.hypot(noise, quantum / math.sqrt(12.0)) for noise, quantum in rows)  # JCGM 100:2008, F.2.2.1

    @property
    def delays(self) -> tuple[float, ...]:
        """Return the delay of each channel as a fraction of the sample period [1]; empty where all convert at once."""
        return tuple(1e-3 * self.rate_Hz * delay for delay in self.delay_ms) if any(self.delay_ms) else ()

    @property
    def time_deviation(self) -> float:
        """Return the standard deviation of the time of a channel over that between two samples [1].

        Its error may lie anywhere within its bound (JCGM 100:2008, 4.3.7).
        """
        return BOUNDED * 1e-3 * self.rate_Hz * self.time_error_ms

    @property
    def conversion_order(self) -> tuple[int, ...]:
        """Return the channels of a sample in the order of their conversion, from 0."""
        return tuple(sorted(range(len(self.counts_per_N)), key=lambda tip: (*self.delay_ms[tip : tip + 1], tip)))

    @property
    def errors_N(self) -> tuple[float, ...]:
        """Return the error of the force of each tip without a touch [N]: noise and drift of zero together."""
        return tuple(math.hypot(noise, zero) for noise, zero in zip(self.noises_N, self.zero_drift_N, strict=True))


@dataclass(frozen=True, kw_only=True)
class SpringReadOut:
    """How the springs of a sensor are read: their signal path where a read-out is named, else by bridges.

    `fastest_s` is the shortest duration of a press by hand that the path can follow [s], where it is known. `folder` is
    that of the design's report, as a command names it.
    """

    springs: Sequence[Spring]
    signal: SignalPath | None = None
    fastest_s: float | None = None
    folder: str = "OUT"


def balanced_order(kinds: Sequence[str]) -> tuple[int, ...]:
    """Return an order of conversion in which the mean time of the channels of both kinds of springs is the same.

    `kinds` are those of the springs, one for each tip; the order is of the tips, from 0. One kind is split about the
    other, as in low, high, high, low. What a delay does to their contrast then cancels on a level sensor. A pair has no
    such order, and keeps that of its tips.
    """
    of_even_number = [kind for kind in dict.fromkeys(kinds) if kinds.count(kind) % 2 == 0]
    if not of_even_number:
        return tuple(range(len(kinds)))
    outer = [tip for tip, kind in enumerate(kinds) if kind == of_even_number[0]]
    inner = [tip for tip, kind in enumerate(kinds) if kind != of_even_number[0]]
    half = len(outer) // 2
    return (*outer[:half], *inner, *outer[half:])


def channel_delays(readout: Readout, kinds: Sequence[str]) -> tuple[float, ...]:
    """Return the delay of each channel behind the first conversion of a sample [ms]; empty where all convert at once.

    An amplifier of several inputs converts them in turn, all of them in each sample.
    """
    amplifier = readout.circuit
    if readout.delay_ms is not None:
        return readout.delay_ms
    inputs = int(amplifier.channels)
    if inputs == 1:
        return ()
    order = balanced_order(kinds)
    return tuple(1e3 / amplifier.rate_Hz * (order.index(tip) % inputs) / inputs for tip in range(len(kinds)))


@dataclass(frozen=True, kw_only=True)
class _Transducer:
    """What turns the deflection or the strain of each spring into a voltage at the amplifier's input.

    `V_per_mm` is None for gauges, whose output depends on the leaf. `noise_V` is one standard deviation; `zero_V` and
    `gain_percent` bound the drifts of zero and of gain, after the changes of temperature of [readout].
    """

    supply_V: float
    V_per_mm: float | None
    noise_V: float
    zero_V: float
    gain_percent: float

    def V_per_N(self, spring: Spring) -> float:
        """Return the voltage per force of a spring [V/N]; raises ValueError for a grid longer than half a leaf."""
        if self.V_per_mm is None:
            return 1e-3 * spring.bridge_output * self.supply_V
        return self.V_per_mm / spring.K


def _gauge_bridge(readout: Readout, process: Process) -> _Transducer:
    """Return a full bridge of foil gauges, as much excited as a leaf of this process bears, or as [readout] says."""
    supply = readout.excitation_V or excitation(process, readout.circuit)
    return _Transducer(
        supply_V=supply,
        V_per_mm=None,
        noise_V=0.0,  # that of the amplifier alone counts
        # All four arms of a bridge see the strain of its drift.
        zero_V=FOIL.gauge_factor * BRIDGE.zero_strain_per_K * readout.tare_K * supply,
        gain_percent=math.hypot(BRIDGE.gain_percent_per_K * readout.drift_K, BRIDGE.linearity_percent),
    )


def _displacement_probe(readout: Readout) -> _Transducer:
    """Return a sensor of displacement, the known one but for the numbers that [readout] gives."""
    V_per_mm = 1e-3 * (readout.sensitivity_mV_per_mm or PROBE.sensitivity_mV_per_mm)
    return _Transducer(
        supply_V=readout.circuit.supply_V,
        V_per_mm=V_per_mm,
        noise_V=1e-3 * (PROBE.noise_um if readout.noise_um is None else readout.noise_um) * V_per_mm,
        zero_V=1e-3 * math.hypot(PROBE.zero_um_per_K * readout.tare_K, PROBE.zero_um) * V_per_mm,
        gain_percent=math.hypot(PROBE.gain_percent_per_K * readout.drift_K, PROBE.linearity_percent),
    )


def _self_heating(springs: Sequence[Spring], supply_V: float) -> float:
    """Return the rise in temperature of the warmest leaf by the four gauges on it [K]; air cools its two faces."""
    per_area = max(1.0 / (2.0 * spring.flexure.length * spring.flexure.depth) for spring in springs)
    return supply_V**2 / RESISTANCE_OHM * per_area / (1e-6 * BRIDGE.film_W_per_m2_K)


def signal_path(readout: Readout, springs: Sequence[Spring], process: Process, kinds: Sequence[str]) -> SignalPath:
    """Return the signal path of a sensor whose tips stand on springs of these kinds, by their names.

    Their stiffness changes with the temperature as the modulus of the process. Raises ValueError for a grid longer than
    half a leaf.
    """
    amplifier = readout.circuit
    is_foil = readout.transducer == "foil"
    transducer = _gauge_bridge(readout, process) if is_foil else _displacement_probe(readout)
    supply = transducer.supply_V
    amplifier_gain_percent = 1e-4 * amplifier.gain_ppm_per_K * readout.drift_K
    amplifier_zero_V = 1e-9 * amplifier.offset_nV_per_K * readout.tare_K

    of_kind = {}  # numbers of a channel by the name of its spring
    for spring in springs:
        V_per_N = transducer.V_per_N(spring)
        counts_per_N = V_per_N * amplifier.counts_per_V
        of_kind[spring.name] = {
            "mV_per_V": 1e3 * V_per_N / supply * spring.force,
            "full_counts": counts_per_N * spring.force,
            "counts_per_N": counts_per_N,
            "noise_N": math.hypot(1e-9 * amplifier.noise_nV, transducer.noise_V) / V_per_N,
            "zero_drift_N": math.hypot(amplifier_zero_V, transducer.zero_V) / V_per_N,
            "gain_drift_percent": math.hypot(amplifier_gain_percent, transducer.gain_percent),
        }

    def each(key: str) -> tuple[float, ...]:
        """Return a number of every channel, in the order of the tips."""
        return tuple(of_kind[kind][key] for kind in kinds)

    heating = _self_heating(springs, supply) if is_foil else 0.0
    modulus_percent_per_K = 100.0 * abs(process.E_per_K or 0.0)
    return SignalPath(
        transducer=readout.transducer,
        amplifier=amplifier.name,
        board=readout.board,
        rate_Hz=amplifier.rate_Hz,
        excitation_V=supply,
        saturation_counts=amplifier.saturation,
        mV_per_V=each("mV_per_V") if is_foil else (),
        full_counts=each("full_counts"),
        counts_per_N=each("counts_per_N"),
        noise_N=each("noise_N"),
        zero_drift_N=each("zero_drift_N"),
        gain_drift_percent=each("gain_drift_percent"),
        modulus_drift_percent=modulus_percent_per_K * readout.drift_K,
        self_heating_K=heating,
        self_heating_percent=modulus_percent_per_K * heating,
        delay_ms=channel_delays(readout, kinds),
        time_error_ms=readout.largest_time_error_ms,
    )

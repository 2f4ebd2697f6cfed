"""The sources of a reading's uncertainty against many presses with planted errors, each read by itself."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from flat_square import linear_pose_forces, square_contact, square_design, square_springs
from scipy.optimize import root
from squares import GENTLE
from stand_ins import with_compliance

from pipeline.reading import pressed_sensor as sensor_module
from pipeline.reading.analysis import analyse_readings, uncertainty_by_poisson
from pipeline.reading.measurement import RiseModel, rise_model, times_by_hand
from pipeline.reading.poses import Placement
from pipeline.reading.pressed_sensor import RISE_TRAVELS
from pipeline.reading.uncertainty import designed_channels, heat_uncertainty, uncertainty_sources
from pipeline.response.contact import contact_compliance
from sensor.design.reading import PRESS_S, PRESS_SAMPLES, ReadingRequirements
from sensor.design.signal_path import SignalPath
from sensor.theory.contrast_law import contrast_weights, stiffened_compliance
from sensor.theory.contrast_rise import RollingDomes
from sensor.theory.creep import NO_CREEP, CreepLaw
from solve.contact.domes import law
from solve.contact.domes.large_strain import large_strain
from solve.contact.linear_response import spring_compliance
from solve.halfspace.layered import base_compliance

E = 2.0
STEP = 1e-4
SMALL = 0.02  # of a slope: what an error moves by the saddle that the offset is taken for is left out
COUNTS = pytest.mark.parametrize("count", [400, pytest.param(4000, marks=pytest.mark.study)])
QUIET = {"noise_percent": 0.0, "stiffness_percent": 0.0, "gain_percent": 0.0}


class Pressed:
    """One press of a square whose forces are those of its own law, and what reads it."""

    def __init__(self, rise_law, travel):
        """Press in equal steps of the travel [mm]; the first sample is not of the touch."""
        self.model = RiseModel(law=rise_law)
        self.travels = travel * np.arange(4, RISE_TRAVELS + 4) / (RISE_TRAVELS + 3)
        self.forces = self.on_springs(np.ones(4))
        self.full_scale = self.forces.max(axis=0)

    def on_springs(self, factors):
        """Return the forces of a unit whose springs are stiffer by factors, (samples, tips)."""
        contrast = self.model.law.contrast
        compliance = np.array(stiffened_compliance(contrast.C, factors)) + np.array(contrast.S) / E
        rows = []
        for x in self.travels:

            def misfit(roots, x=x):
                return compliance @ roots**3 + contrast.hertz * E ** (-2.0 / 3.0) * roots**2 + contrast.gaps - x

            found = root(misfit, np.full(4, 0.5), jac=False, tol=1e-13)
            assert found.success
            rows.append(found.x**3)
        return np.array(rows)

    def read_as(self, factors, forces):
        """Return the modulus by springs that are taken for stiffer by factors."""
        known = self.model.law
        contrast = replace(known.contrast, C=stiffened_compliance(known.contrast.C, factors))
        return RiseModel(law=replace(known, contrast=contrast)).read_modulus(forces)

    def channels(self, signal=None, creep=NO_CREEP, press_s=PRESS_S, **reading):
        """Return its channels with planted errors only."""
        return designed_channels(ReadingRequirements(**QUIET | reading), self.full_scale, signal, creep, press_s)

    def sources(self, *signal, **planted):
        """Return the sources of this press; noise is that of its own samples."""
        channels = self.channels(*signal, **planted)
        found = self.model.read(self.forces, channels.noises)
        return uncertainty_sources([found], channels, PRESS_SAMPLES, {})

    def scattered(self, planted, count):
        """Return the relative standard deviation of some readings, each of forces with a planted error."""
        rng = np.random.default_rng(5)
        return np.std([self.model.read_modulus(planted(rng)) for _ in range(count)]) / E

    def moved(self, *reads):
        """Return by which fraction E moves with small errors of all tips together, in squares; each takes one a tip."""
        found = []
        for read, tip in itertools.product(reads, np.eye(4)):
            more, less = (read(step * tip) for step in (STEP, -STEP))
            found.append((more - less) / (2.0 * STEP * E))
        return np.linalg.norm(found)

    def by_springs(self, by):
        """Return the modulus by springs that are taken for stiffer by fractions."""
        return self.read_as(1.0 + by, self.forces)

    def by_gains(self, by):
        """Return the modulus of forces that are shown too large by fractions."""
        return self.model.read_modulus(self.forces * (1.0 + by))

    def by_units(self, by):
        """Return the modulus by deflections times known stiffnesses, of springs that are stiffer by fractions."""
        return self.model.read_modulus(self.on_springs(1.0 + by) / (1.0 + by))

    def by_zeros(self, by):
        """Return the modulus of forces that are off by shares of the full scale."""
        return self.model.read_modulus(self.forces + by * self.full_scale)

    def by_drifts(self, by):
        """Return the modulus of forces that drift by shares of the full scale after the touch, to the last sample."""
        part = (np.arange(RISE_TRAVELS)[:, None] - 1) / (RISE_TRAVELS - 2)
        return self.model.read_modulus(self.forces + part * by * self.full_scale)

    def by_times(self, by):
        """Return the modulus of channels that are later [s]: they show what forces have become, by a slowing hand."""
        steps = np.diff(self.forces, axis=0, prepend=self.forces[:1])
        rates = steps / np.diff(times_by_hand(RISE_TRAVELS), prepend=0.0)[:, None]
        return self.model.read_modulus(self.forces + by * rates)


@COUNTS
def test_noise_scatters_readings_as_told(count, pressed):
    """Of samples that are independent, by a share of the largest force of each channel and by a force."""
    told = pressed.sources(noise_percent=0.1, noise_N=5e-4)
    noise = np.hypot(0.001 * pressed.full_scale, 5e-4)
    found = pressed.scattered(lambda rng: pressed.forces + noise * rng.standard_normal(pressed.forces.shape), count)
    by_percent, by_force = (told.contributions[name] for name in ("noise_percent", "noise_N"))
    # 3.5 deviations of a deviation, and 0.01 for no straight law
    assert np.hypot(by_percent, by_force) == pytest.approx(found, rel=3.5 / np.sqrt(2.0 * count) + 0.01)
    assert min(by_percent, by_force) > 0.1 * found
    assert told.noise_slope == pytest.approx(by_percent / 0.1)


def domes():
    places = 3.0 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    rolling = RollingDomes(
        positions=tuple(map(tuple, places.tolist())),
        weights=contrast_weights(places.tolist(), ("low", "high", "low", "high")),
        dome_radius=10.0,
        mean_curvature=1.0 / 50.0,
        poisson=0.3,
    )
    return rolling.law(np.diag([1.0 / 0.15, 1.0 / 1.4] * 2).tolist())


@pytest.fixture(scope="module", params=["flat", "domes"])
def pressed(request):
    if request.param == "domes":
        return Pressed(domes(), 0.9)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sensor_module, "pose_forces", linear_pose_forces)
        model = rise_model(with_compliance(square_design(), square_contact(), square_springs()))
    return Pressed(model.law, 0.6)


def test_press_without_error_is_read_exactly(pressed):
    assert pressed.model.read_modulus(pressed.forces) == pytest.approx(E, rel=1e-8)


def test_noise_is_that_of_a_press_of_sixty_samples(pressed):
    """A press of sixteen tells it up to a tenth too large: its ends weigh more than by the root of the count."""
    channels = pressed.channels(noise_percent=0.1)
    fine = np.linspace(*pressed.travels[[0, -1]], PRESS_SAMPLES)
    many = np.stack([np.interp(fine, pressed.travels, tip) for tip in pressed.forces.T], axis=1)
    of_few, of_many = (
        uncertainty_sources([pressed.model.read(forces, channels.noises)], channels, samples, {})
        for forces, samples in ((pressed.forces, RISE_TRAVELS), (many, PRESS_SAMPLES))
    )
    assert 1.0 <= of_few.contributions["noise_percent"] / of_many.contributions["noise_percent"] < 1.1


NONE = (0.0,) * 4
QUIET_SIGNAL = SignalPath(
    amplifier="ADS1220",
    board="",
    rate_Hz=80.0,
    excitation_V=3.0,
    saturation_counts=1 << 23,
    full_counts=(1e6,) * 4,
    counts_per_N=(1e9,) * 4,
    noise_N=NONE,
    zero_drift_N=NONE,
    gain_drift_percent=NONE,
    modulus_drift_percent=0.0,
    delay_ms=(),
    time_error_ms=0.0,
)
"""A signal path without any error but the planted one."""
LATE = replace(QUIET_SIGNAL, time_error_ms=2.0)
DRIFTS = np.array([0.2, 0.1, 0.3, 0.4])  # of gains [%]
CREEP = CreepLaw(per_decade=0.03, error=0.01)


def drifting(pressed):
    """Return a signal path whose zeros are off by at most 2e-4 of the full scale."""
    return replace(QUIET_SIGNAL, zero_drift_N=tuple((2e-4 * pressed.full_scale).tolist()))


def noisy(pressed):
    """Return a signal path whose noise is a thousandth of the full scale."""
    return replace(QUIET_SIGNAL, noise_N=tuple((1e-3 * pressed.full_scale).tolist()))


def counting(pressed):
    """Return a signal path that shows the full scale by 4000 counts."""
    return replace(QUIET_SIGNAL, counts_per_N=tuple((4000.0 / pressed.full_scale).tolist()))


def noise_of(pressed, percent):
    """Return what noise of a percentage of the full scale adds, which drawn noise confirms."""
    return pressed.sources(noise_percent=percent).contributions["noise_percent"]


def of_creep(pressed):
    """Return by how much readings move of a share of a decade that is one standard deviation off, and of its time.

    Springs are stiffer in the press than told, and the forces as much larger: deflections are right. The effective time
    is anywhere within a factor e.
    """
    more = CreepLaw(CREEP.per_decade + 1e-5).press_stiffness_ratio(30.0, 3.0) / CREEP.press_stiffness_ratio(30.0, 3.0)
    shown = pressed.on_springs(more * np.ones(4)) / more
    by_share = (pressed.model.read_modulus(shown) / E - 1.0) * CREEP.error / 1e-5
    return np.hypot(by_share, CREEP.exponent / np.sqrt(3.0))


# A bound is the root of three times a standard deviation. A drift counts by the mean of the slopes over the press, and
# by the offset that it moves it is left out; of times the F^(-1/3) of domes is taken at its mean, within a quarter.
MOVES = {
    "springs": ("stiffness", {"stiffness_percent": 0.3}, lambda one: 0.003 * one.moved(one.by_springs), SMALL),
    "springs of units": (
        "stiffness",
        {"stiffness_percent": 0.3, "calibrated_by": "plate"},
        lambda one: 0.003 * one.moved(one.by_units),
        SMALL,
    ),
    "gains": ("gain", {"gain_percent": 0.2}, lambda one: 0.002 * one.moved(one.by_gains), SMALL),
    "gains of units": (
        "gain",
        {"gain_percent": 0.2, "calibrated_by": "plate"},
        lambda one: one.sources(gain_percent=0.2).contributions["gain"],
        1e-12,
    ),
    "zeros": (
        "zero_drift",
        {"signal": drifting},
        lambda one: 2e-4 / np.sqrt(3.0) * one.moved(one.by_zeros, one.by_drifts),
        0.04,
    ),
    "times": ("times", {"signal": LATE}, lambda one: 2e-3 / np.sqrt(3.0) * one.moved(one.by_times), 0.25),
    "times of a slower press": (
        "times",
        {"signal": LATE, "press_s": 6.0},
        lambda one: 0.5 * one.sources(LATE).contributions["times"],
        1e-12,
    ),
    "drifts of gains": (
        "gain_drift",
        {"signal": replace(QUIET_SIGNAL, gain_drift_percent=tuple(DRIFTS.tolist()))},
        lambda one: 0.01 / np.sqrt(3.0) * one.moved(lambda by: one.by_gains(DRIFTS * by)),
        SMALL,
    ),
    "creep": ("creep", {"creep": CREEP}, of_creep, 0.01),
    "noise of a read-out": ("readout_noise", {"signal": noisy}, lambda one: noise_of(one, 0.1), 1e-9),
    # a rounded number is off by 12^-1/2 of its step
    "counts": ("quantisation", {"signal": counting}, lambda one: noise_of(one, 100.0 / 4000.0 / np.sqrt(12.0)), 1e-9),
}
"""Planted errors: the source that tells them, what is planted, by how much readings move, and how near that is told."""


@pytest.mark.parametrize("name", MOVES)
def test_planted_errors_move_readings_as_told(name, pressed):
    source, planted, moved, rel = MOVES[name]
    planted = {key: value(pressed) if callable(value) else value for key, value in planted.items()}
    found = pressed.sources(**planted)
    if source == "times" and not pressed.model.law.contrast.hertz:
        rel = min(rel, SMALL)
    assert found.contributions[source] == pytest.approx(moved(pressed), rel=rel)
    assert found.total == pytest.approx(found.contributions[source], rel=1e-12)
    assert found.stiffness_slope == pytest.approx(pressed.moved(pressed.by_springs), rel=SMALL)


def test_drift_of_the_modulus_of_leaves_moves_readings_as_told(pressed):
    """Leaves that are stiffer by a fraction show the force of the same deflection, which is larger by it."""
    stiffer = np.full(4, 1.003)
    moved = abs(pressed.model.read_modulus(pressed.on_springs(stiffer) / stiffer) / E - 1.0)
    told = heat_uncertainty(replace(QUIET_SIGNAL, modulus_drift_percent=0.3))["modulus_drift"]
    assert told * np.sqrt(3.0) == pytest.approx(moved, rel=0.01)


def test_noise_for_an_uncertainty_gives_it(pressed):
    found = pressed.sources(noise_percent=0.1, gain_percent=0.05)
    loud = found.noise_to_reach(0.02)
    assert pressed.sources(noise_percent=loud, gain_percent=0.05).total == pytest.approx(0.02, rel=1e-6)
    assert found.noise_to_reach(1e-6) is None


def test_sources_of_readings_that_are_equally_likely_add_by_their_mean_squares(pressed):
    """Of a whole press, of half of it, and of both together."""
    channels = pressed.channels(gain_percent=0.3, noise_percent=0.1)
    found = [pressed.model.read(pressed.forces[:count], channels.noises) for count in (RISE_TRAVELS, 8)]
    one, other, both = (
        {**sources.contributions, "stiffness slope": sources.stiffness_slope, "noise slope": sources.noise_slope}
        for each in (found[:1], found[1:], found)
        for sources in [uncertainty_sources(each, channels, PRESS_SAMPLES, {"pose": 0.01})]
    )
    assert other["noise_percent"] > 1.5 * one["noise_percent"]
    assert both == pytest.approx({name: np.sqrt(0.5 * (size**2 + other[name] ** 2)) for name, size in one.items()})


@pytest.mark.parametrize(("poisson", "other"), [(0.3, 0.325), (0.49, 0.465)])
def test_flesh_of_another_ratio_moves_a_square_of_flat_tips_as_told(poisson, other, monkeypatch):
    """On a half-space all of the compliance is proportional to 1 - nu^2: forces in closed form.

    From 0.49 it is moved down by a standard deviation: up there is no flesh of more than a half.
    """
    monkeypatch.setattr(sensor_module, "pose_forces", linear_pose_forces)
    design = square_design(tilt_deg=1.0)
    fruit = replace(design.fruit, poisson=poisson)
    assert abs(other - poisson) == pytest.approx(0.5 * fruit.poisson_spread)
    sensor = with_compliance(replace(design, fruit=fruit), square_contact(), square_springs())
    softer = (1.0 - other**2) / (1.0 - poisson**2)
    model = rise_model(sensor)
    for row in analyse_readings(sensor).moduli:
        S = softer * square_contact().S / row.E
        press = np.array([np.linalg.solve(square_springs() + S, np.full(4, x)) for x in np.linspace(0.1, 0.6, 11)])
        moved = abs(model.read_modulus(press) / row.E - 1.0)
        assert row.sources.contributions["poisson"] == pytest.approx(moved, rel=1e-6)


def test_base_under_flesh_of_another_ratio():
    """On a layer of 4 mm: forces that the flesh makes by that ratio, read by the law of the fruit's own.

    Where the other ratio is felt as E / reduced, the base is felt as reduced times its own compliance: to first order.
    """
    design = replace(GENTLE, fruit=replace(GENTLE.fruit, thickness_mm=4.0, poisson=0.45, poisson_spread=0.04))
    own = Pressed(domes(), 0.9)
    contrast = own.model.law.contrast
    axes = np.array(design.tips.places_mm)
    apart = np.linalg.norm(axes[:, None] - axes, axis=-1)
    reduced = (1.0 - 0.45**2) / (1.0 - 0.47**2)
    change = reduced * base_compliance(4.0, 0.47, apart) - base_compliance(4.0, 0.45, apart)
    other_law = replace(contrast, S=(np.array(contrast.S) + change).tolist())
    other = Pressed(replace(own.model.law, contrast=other_law), 0.9)
    moved = reduced * own.model.read_modulus(other.forces) / E - 1.0
    told = uncertainty_by_poisson(design, own.model, own.forces)
    assert told == pytest.approx(abs(moved), rel=0.04)  # the next order is 0.04 of it
    assert abs(told - abs(reduced - 1.0)) > 0.1 * told


@pytest.fixture(scope="module")
def gentle():
    """Return a square of domes that is read on a ball with flesh of 8 to 20 mm, its compliance and its analysis."""
    design = replace(
        GENTLE,
        press=replace(GENTLE.press, travel_mm=0.6),
        reading=ReadingRequirements(tilt_deg=1.0, off_centre_mm=0.0, radius_spread=0.05, thickness_mm=(8.0, 20.0)),
    )
    design = replace(design, tips=replace(design.tips, side_mm=5.8))
    sensor = with_compliance(
        design, contact_compliance(design.fruit, design.tips), spring_compliance(0.3, 2.0, 0.3, 2.0)
    )
    return sensor, analyse_readings(sensor)


def bias_on(sensor, fruit, modulus):
    """Return E read / E - 1 of a level press on another fruit, whose compliance is solved anew."""
    design = replace(sensor.design, fruit=fruit)
    other = replace(sensor, design=design, contact=contact_compliance(fruit, design.tips))
    press = other.presses([modulus], [Placement(from_touch=True)]).F[0, 0]
    return rise_model(sensor).read_modulus(press) / modulus - 1.0


@pytest.mark.study
@pytest.mark.parametrize("row", [0, -1])
def test_flesh_of_another_ratio_moves_a_square_of_domes_as_told(gentle, row, monkeypatch):
    """By presses on flesh of that ratio: within what a piece that ends at its sides differs by from a layer.

    This is at small strain. At large strain flesh of a larger ratio carries less of it, so that less is left.
    """
    sensor, told = gentle
    fruit = sensor.design.fruit
    other = replace(fruit, poisson=fruit.poisson + 0.5 * fruit.poisson_spread)
    found = told.moduli[row]
    as_told = found.sources.contributions["poisson"]
    assert 0.0 < bias_on(sensor, other, found.E) < as_told
    monkeypatch.setattr(law, "large_strain", lambda *given: large_strain(*given[:3], fruit.poisson))
    assert as_told == pytest.approx(bias_on(sensor, other, found.E), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("row", [0, pytest.param(-1, marks=pytest.mark.study)])
def test_flesh_of_another_thickness_moves_a_square_of_domes_as_told(gentle, row):
    """By presses on both ends of the range: the larger of both.

    The contrast hears how what the base takes off differs between tips, which is small against it: the quarter that
    is left open of the whole is up to all of this. On a ball of 35 mm it is told too large.
    """
    sensor, told = gentle
    found = told.moduli[row]
    ends = [replace(sensor.design.fruit, thickness_mm=h, length_mm=None, width_mm=None) for h in (8.0, 20.0)]
    most = max(abs(bias_on(sensor, fruit, found.E)) for fruit in ends)
    assert 1e-3 < most <= found.sources.contributions["thickness"] * np.sqrt(3.0) <= 2.0 * most

"""Readings of a pair at large strain: of forces that the solver gives, whose balance and interpolation are its own."""

from dataclasses import replace

import numpy as np
import pytest
from measured_units import MeasuredDesign, stated_and_moved
from stand_ins import INFO

from cad.quantity import InputError
from cad.theory.soft_tissue import large_strain_factor
from cad.theory.two_spring_law import curve_nonlinearity, curve_shares
from pipeline.measure.calibrating.unit_table import unit_table
from pipeline.measure.calibrating.unit_verdicts import unit_verdicts
from pipeline.measure.unit.deep_pair import Samples
from pipeline.measure.unit.deep_reading import other_laws
from pipeline.measure.unit.firmware import c_header
from pipeline.measure.unit.measuring import MeasuringUnit
from pipeline.measure.unit.pair_press import PairPress, single_reading
from pipeline.reading.read_out import DepthFactor
from solve.contact.large_response import large_response
from solve.contact.scene import Scene
from solve.large_strain.force_curve import ForceCurve

TRAVELS = np.linspace(0.03, 0.6, 40)
DEPTHS = (0.003, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
# Of log neo-Hooke at nu = 0.45, sharp, no slip, by an independent program, over its start.
FACTORS = np.array([1.0027, 0.9964, 0.9894, 0.9798, 0.9723, 0.9659, 0.9609, 0.9547]) / 1.0027
CURVE = ForceCurve(depths=DEPTHS, factors=tuple(FACTORS), errors=(2e-3,) * 8, grip=1.0, asked=0.6, info=INFO)
BENT = [np.ones(8), np.linspace(-1.0, 1.0, 8), np.sign(np.array(DEPTHS) - 0.25)]


def times(ratios):
    """Return the curve with its factors times ratios."""
    return replace(CURVE, factors=tuple((FACTORS * ratios).tolist()))


class DeepDesign(MeasuredDesign):
    """The paper's sensor on flesh at large strain, whose curve is given, with a bar of 0.5 % at each depth."""

    def __init__(self):
        super().__init__("paper")
        design = replace(self.design, press=replace(self.design.press, strain="large"))
        self.report = replace(self.report, design=design)
        self.report = self.with_bars(0.5).report
        self.scene = Scene(fruit=design.fruit, tips=design.tips, press=design.press)

    def press(self, E, lead=0.0, curve=CURVE, travels=TRAVELS):
        """Return forces [N] over travels, (travels, tips); the low tip stands back by a lead [mm]."""
        scene = replace(self.scene, height_offset_mm=(-lead, 0.0) if lead else ())
        return large_response(scene, self.contact, self.C, curve, [E], travels).F[0]

    def with_bars(self, percent):
        """Return a unit whose curve has these error bars [%]; with None its flesh is linear."""
        depths = np.linspace(DEPTHS[0], DEPTHS[-1], 61)
        rows = zip(depths.tolist(), CURVE.factor(depths).tolist(), strict=True)
        table = tuple(DepthFactor(depth_sides=depth, factor=g, error_percent=percent or 0.0) for depth, g in rows)
        read_out = replace(self.report.read_out, large_strain=() if percent is None else table)
        return MeasuringUnit(report=replace(self.report, read_out=read_out), unit=self.measuring().unit)


@pytest.fixture(scope="module")
def deep():
    return DeepDesign()


def read(sensor, forces):
    press = PairPress(sensor)
    for low, high in forces.tolist():
        if min(low, high) > 0.0:
            press.add(low, high)
    return press.reading()


@pytest.mark.parametrize("E", [0.5, 1.3, 3.5])
def test_level_press_is_read_by_line_and_by_ratio(deep, E):
    forces = deep.press(E)
    reading = read(deep.measuring(), forces)
    assert pytest.approx(E, rel=1e-4) == reading.E
    assert reading.others["force_ratio"] == pytest.approx(E, rel=1e-4)
    assert reading.flags == ()
    assert pytest.approx(E, rel=1e-4) == single_reading(deep.measuring(), forces[-1]).E
    level = deep.measuring().deep.forces(E, 0.6)
    np.testing.assert_allclose(level, deep.press(E, travels=np.array([0.6]))[0], rtol=1e-5)


@pytest.mark.parametrize("E", [0.5, 1.0])
@pytest.mark.parametrize("lead", [-0.1, -0.05, 0.05, 0.1])
def test_line_reads_through_a_lead(deep, E, lead):
    """Also where the force ratio tells no modulus, as under a lead of -0.1 mm."""
    reading = read(deep.measuring(), deep.press(E, lead=lead))
    assert pytest.approx(E, rel=1e-3) == reading.E
    assert reading.tilt == pytest.approx(np.degrees(np.arctan(abs(lead) / 8.0)), rel=0.02)
    assert ("force_ratio" in reading.others) == (lead > -0.1)
    # At -0.05 mm and 0.5 MPa the ratio hardly changes with the modulus: its noise explains the difference.
    assert "read_outs_disagree" in reading.flags or (E, lead) == (0.5, -0.05)


def test_flesh_of_another_law_is_inside_the_uncertainty(deep):
    for name, law in other_laws(deep.measuring(), deep.measuring().deep).items():
        curve = replace(CURVE, factors=tuple(np.interp(DEPTHS, law.depths, law.factors).tolist()))
        reading = read(deep.measuring(), deep.press(1.0, curve=curve))
        assert 0.01 < abs(reading.E - 1.0) < reading.u * reading.E
        assert reading.others[name] == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize("bent", BENT)
def test_curve_anywhere_within_its_bar_is_inside_what_it_adds(deep, bent):
    """Flesh whose curve is off alike, tilted or turned by its bar: of a reading, of P_max and of NL (off alike)."""
    curve = times(1.0 + 0.005 * bent)
    forces = deep.press(1.0, curve=curve)
    reading = read(deep.measuring(), forces)
    by_curve = 0.5 * np.sqrt(3.0 * (reading.u**2 - read(deep.with_bars(0.0), forces).u ** 2))
    assert 0.001 < abs(reading.E - 1.0) < by_curve
    P, NL = unit_verdicts(deep.measuring(), ())
    true = targets_by_the_solver(deep, curve)
    assert 0.002 < abs(P.value - true[0]) <= P.error
    if bent.min() > 0.0:
        assert 1e-5 < abs(NL.value - true[1]) <= NL.error
    assert targets_by_the_solver(deep, CURVE) == pytest.approx([P.value, NL.value], rel=1e-4)


def targets_by_the_solver(deep, curve):
    """Return P_max and NL at mid-range of the sensor on flesh of a curve."""
    moduli = [deep.design.fruit.E_max_MPa * fraction for fraction in curve_shares(2)]
    low, high = np.transpose([deep.press(E, curve=curve, travels=TRAVELS[-1:])[0] for E in moduli])
    P = (high / low).tolist()
    return P[-1], curve_nonlinearity(P, moduli, "mid-range")


def test_curve_that_is_too_uncertain_leaves_the_unit_undecided(deep):
    """Springs and curve known exactly leave no error; a curve ten times worse is ten times worse in the table."""
    assert [verdict.error for verdict in unit_verdicts(deep.with_bars(0.0), ())] == pytest.approx([0.0, 0.0], abs=1e-9)
    loose = deep.with_bars(5.0)
    assert unit_verdicts(loose, ())[0].passed is None
    wide, narrow = (unit_table(sensor, sensor)[0].u for sensor in (loose, deep.measuring()))
    assert wide == pytest.approx(10.0 * narrow)


def test_poisson_s_ratio_moves_the_reading_by_both_ways_it_is_felt(deep):
    """Flesh of another nu answers as E / (1 - nu^2) and bends its curve: both move E, and the second is seen."""
    fruit = deep.design.fruit
    spread = 0.02
    forces = deep.press(1.3)
    u = []
    for known in (spread, 0.0):
        design = replace(deep.report.design, fruit=replace(fruit, poisson_spread=known))
        report = replace(deep.report, design=design)
        u.append(read(MeasuringUnit(report=report, unit=deep.measuring().unit), forces).u)
    at_nu = {nu: sharp(nu) for nu in (fruit.poisson - spread, fruit.poisson, fruit.poisson + spread)}
    low, nominal, high = at_nu.values()
    moved = [1.3 / read(deep.measuring(), deep.press(1.3, curve=times(end / nominal))).E for end in (low, high)]
    by_curve = 0.5 * (moved[1] - moved[0])
    by_felt = -2.0 * fruit.poisson * spread / (1.0 - fruit.poisson**2)
    assert abs(by_curve) > 0.05 * abs(by_felt)
    assert 0.5 * np.sqrt(u[0] ** 2 - u[1] ** 2) == pytest.approx(abs(by_curve + by_felt), rel=0.03)


def sharp(nu):
    return np.array([large_strain_factor(depth, nu) for depth in DEPTHS])


@pytest.mark.parametrize("tip", [0, 1])
@pytest.mark.parametrize("field", ["K_percent", "gain_percent"])
def test_springs_and_gains_move_the_reading_as_is_said(deep, tip, field):
    stated, moved = stated_and_moved(deep.measuring(), deep.press(1.3), read, field, tip)
    assert stated == pytest.approx(moved, rel=0.03)


def test_noise_is_as_said(deep, rng):
    sensor = deep.measuring()
    forces = deep.press(1.3)
    lines = []
    for _ in range(30):
        noisy = forces + rng.normal(0.0, sensor.noises, forces.shape)
        lines.append(sensor.deep.line(Samples(np.ones(len(forces)), noisy), sensor.noises))
    E = np.array([line.modulus for line in lines])
    assert abs(E.mean() - 1.3) < 3.0 * E.std() / np.sqrt(len(E))
    assert E.std() / 1.3 == pytest.approx(lines[0].error, rel=0.4)  # of 30 draws: 13 % one sigma


def test_press_deeper_than_was_solved_is_flagged_and_far_deeper_refused(deep):
    longer = replace(CURVE, depths=(*DEPTHS[:-1], 1.5), asked=1.5)
    flagged, refused = (
        read(deep.measuring(), deep.press(0.5, curve=longer, travels=np.linspace(0.05, travel, 40)))
        for travel in (0.7, 1.2)
    )
    assert "deeper_than_solved" in flagged.flags
    assert (refused.E, refused.flags) == (None, ("out_of_range", "deeper_than_solved"))


def test_forces_of_no_fruit_tell_no_modulus(deep):
    forces = deep.press(1.3)[:, ::-1]
    assert read(deep.measuring(), forces).E is None
    assert single_reading(deep.measuring(), forces[-1]).flags == ("out_of_range",)


def test_firmware_is_refused_by_name(deep):
    with pytest.raises(InputError) as caught:
        c_header(deep.measuring())
    assert (caught.value.field, caught.value.value) == ("press.strain", "large")

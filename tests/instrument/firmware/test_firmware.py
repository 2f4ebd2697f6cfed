"""Firmware compiled by the system's compiler, or run by the interpreter, reads as `pipeline read` does."""

import ast
import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measured_units import MeasuredDesign, printed_by_header, read_log, read_press, with_heights

from instrument.firmware.firmware import module_text
from instrument.press import press_core
from instrument.press.fruit_of_presses import fruit_answer
from instrument.press.fruit_reading import flags_of_forces
from instrument.press.press_core import Unit
from instrument.press.reference_ball import BallCorrection
from solve.contact.poses import Pose, Stand

AGREES = 1e-5
IN_FIRMWARE = (
    *("bad_force", "lift_off", "out_of_range", "saturated", "not_tared", "few_samples", "no_rise", "too_fast"),
    "presses_disagree",
)
"""Flags of firmware, from bit 0 on: programs of users know them by number."""
FACTORS = {"mango": (1.19, 1.11, 1.15, 1.12), "paper": (1.19, 1.11)}
MAIN = """
#include <stdio.h>
#include "unit.h"
int main(void)
{
    float f[TWINTIP_TIPS];
    BEFORE
    while (fread(f, sizeof f, 1, stdin) == 1) {
        EACH
    }
    AFTER
    return 0;
}
"""
PRINT = 'printf("%.9g %.9g %u\\n", (double)found.E, (double)found.E_reduced, (unsigned)found.flags);'
PRESS = {
    "BEFORE": "twintip_press press;\n twintip_begin(&press);",
    "EACH": 'printf("0 0 %u\\n", (unsigned)twintip_add(&press, f));',
    "AFTER": f"const twintip_reading found = twintip_end(&press);\n{PRINT}",
}

FRUIT = {
    "BEFORE": "twintip_press press;\n twintip_one_fruit fruit = {0};\n twintip_begin(&press);",
    "EACH": """if (f[0] == f[0]) { twintip_add(&press, f); continue; }
        const twintip_reading each = twintip_end(&press);
        twintip_fruit_add(&fruit, &each);
        twintip_begin(&press);
        const twintip_fruit_reading found = twintip_fruit_read(&fruit);
        printf("%.9g %.9g %.9g %u %u\\n", (double)found.E, (double)found.E_reduced, (double)found.scatter,
               (unsigned)found.flags, (unsigned)found.presses);""",
    "AFTER": "",
}
"""Reads presses, each with a row of no numbers behind it, and tells the fruit after each of them."""


@pytest.fixture
def in_c(tmp_path):
    """Return a function that compiles the firmware of a unit and returns what it prints of a press of forces."""

    def run(sensor, rows, words=PRESS):
        program = MAIN
        for word, code in words.items():
            program = program.replace(word, code)
        return printed_by_header(tmp_path, sensor, program, np.asarray(rows, dtype=np.float32))

    return run


def module_of(folder, sensor):
    path = folder / "unit.py"
    path.write_text(module_text(sensor), encoding="utf-8")
    return runpy.run_path(str(path))


def at_random(rng, tips):
    """Return forces, many of them no sensible ones: NaN, infinite, negative, huge, zero."""
    rows = rng.uniform(-0.2, 1.5, (1000, tips)) * 10.0 ** rng.uniform(-2.0, 0.5, (1000, tips))
    odd = np.array([math.nan, math.inf, -math.inf, -1.0, 1e30, 0.0, -0.0])
    chosen = rng.random(rows.shape) < 0.1
    rows[chosen] = rng.choice(odd, chosen.sum())
    return rows.astype(np.float32)


def bits(flags):
    return sum(1 << IN_FIRMWARE.index(flag) for flag in flags if flag in IN_FIRMWARE)


def both(sensor, rows, tmp_path):
    """Return what the command reads of a press, and what the MicroPython module does: E and flags."""
    module = module_of(tmp_path, sensor)["Press"]()
    for row in rows.astype(float):
        module.add(row.tolist())
    expected = read_log(sensor, rows)
    E, _, flags = module.read()
    return (expected.E, bits(expected.flags)), (E, flags)


@pytest.mark.parametrize("samples", [pytest.param(10, marks=pytest.mark.slow), 1000])
def test_press_of_a_square_agrees_sample_for_sample(samples, mango, rng, tmp_path, in_c):
    """Random poses and heights, there and back, with noise and air beside; single precision over a thousand samples."""
    sensor = mango.measuring(FACTORS["mango"])
    travel = mango.design.press.travel_mm
    flags = set()
    for E in np.exp(rng.uniform(math.log(0.5), math.log(3.5), 4)).tolist():
        x = np.concatenate([np.linspace(0.15, 1.0, samples), np.linspace(0.9, 0.5, 3)]) * travel
        tilt = tuple(rng.uniform(-2.0, 2.0, 2))
        steps = np.linspace(0.15, 1.0, 60) * travel
        forces = mango.forces(
            [Pose(E=E, travel=at, stand=Stand(tilt_deg=tilt)) for at in steps.tolist()], FACTORS["mango"]
        )
        rows = np.column_stack([np.interp(x, steps, row) for row in forces.T])
        rows = rows + rng.normal(size=rows.shape) * sensor.noises
        rows = np.concatenate([np.zeros((3, 4)), rows, np.zeros((3, 4))]).astype(np.float32)
        higher = with_heights(sensor, rng.uniform(-0.03, 0.03, 4))
        (expected, bit), module = both(higher, rows, tmp_path)
        assert module == (pytest.approx(expected, rel=1e-9), bit)
        found, reduced, found_bits = in_c(higher, rows)[-1].tolist()
        assert (found, found_bits) == (pytest.approx(expected, rel=AGREES), bit)
        assert reduced == pytest.approx(expected * higher.reduced(1.0), rel=AGREES)
        flags.add(bit)
    assert 0 in flags


@pytest.mark.parametrize("wide", [0.02, 0.25])
def test_fruit_of_one_to_ten_presses_agrees(wide, mango, rng, tmp_path, in_c):
    """Presses of moduli that scatter; firmware keeps the last eight. The third tells nothing."""
    sensor = mango.measuring(FACTORS["mango"])
    travel = mango.design.press.travel_mm
    fruit = module_of(tmp_path, sensor)
    one_fruit = fruit["Fruit"]()
    rows, presses, expected, by_module = [], [], [], []
    for number, E in enumerate(np.exp(wide * rng.normal(size=10)).tolist()):
        steps = np.linspace(0.1, 1.0, 2 if number == 2 else 60) * travel
        forces = mango.forces([Pose(E=E, travel=at) for at in steps.tolist()], FACTORS["mango"])
        forces = (forces + rng.normal(size=forces.shape) * sensor.noises).astype(np.float32)
        rows += [forces, np.full((1, 4), math.nan)]
        presses.append(read_log(sensor, forces))
        kept = [each for each in presses if each.E is not None][-8:]
        expected.append(fruit_answer(sensor, kept, "1"))
        each = fruit["Press"]()
        for row in forces.astype(float).tolist():
            each.add(row)
        one_fruit.add(each.read()[0], each.noise)
        by_module.append(one_fruit.read())
    by_c = in_c(sensor, np.concatenate(rows), FRUIT).tolist()
    for told, module, (E, reduced, scatter, flags, counted) in zip(expected, by_module, by_c, strict=True):
        assert module == (
            *(pytest.approx(told.E, rel=1e-9), pytest.approx(told.reduced, rel=1e-9)),
            *(pytest.approx(told.scatter or 0.0, rel=1e-9), bits(told.flags)),
        )
        assert (E, reduced) == (pytest.approx(told.E, rel=AGREES), pytest.approx(told.reduced, rel=AGREES))
        assert scatter == pytest.approx(told.scatter or 0.0, abs=AGREES)
        assert (flags, counted) == (bits(told.flags), told.counted)
    assert (expected[-1].counted, "presses_disagree" in expected[-1].flags) == (8, wide > 0.1)


def test_of_two_touches_firmware_reads_the_deeper_one(mango, tmp_path, in_c):
    """Whichever comes first, and with a long hold behind: as the command reads that press alone."""
    sensor = mango.measuring(FACTORS["mango"])
    travels = np.linspace(0.1, 1.0, 20) * mango.design.press.travel_mm
    tilted, level = (
        mango.forces(
            [Pose(E=1.0, travel=x, stand=Stand(tilt_deg=tilt)) for x in (part * travels).tolist()], FACTORS["mango"]
        )
        for part, tilt in ((0.6, (2.0, 0.0)), (1.0, (0.0, 0.0)))
    )
    higher = with_heights(sensor, (0.03, 0.0, 0.03, 0.0))
    lift = np.zeros((2, 4))
    held = np.concatenate([level, np.repeat(level[-1:], 500, axis=0)])
    for parts, alone in (((tilted, lift, level), level), ((level, lift, tilted), level), ((tilted, lift, held), held)):
        rows = np.concatenate([lift, *parts]).astype(np.float32)
        module = module_of(tmp_path, higher)["Press"]()
        for row in rows.astype(float).tolist():
            module.add(row)
        (expected, bit), _ = both(higher, np.concatenate([lift, alone]).astype(np.float32), tmp_path)
        assert bit == 0
        assert pytest.approx(expected, rel=1e-12) == read_log(higher, rows).E
        assert module.read()[::2] == (pytest.approx(expected, rel=1e-9), 0)
        assert in_c(higher, rows)[-1, ::2].tolist() == [pytest.approx(expected, rel=AGREES), 0]


def test_presses_that_tell_nothing_have_their_flags_in_firmware(mango, tmp_path, in_c):
    sensor = mango.measuring()
    travels = (np.linspace(0.1, 1.0, 40) * mango.design.press.travel_mm).tolist()
    forces = mango.forces([Pose(E=1.0, travel=x) for x in travels])
    for rows, bit in (
        (forces[-5:], 32),
        (np.repeat(forces[-1:], 30, axis=0), 64),
        (forces[-9:], 64),
        (forces[:, [1, 0, 3, 2]], 4),
        (np.concatenate([forces[:3], np.zeros((1, 4)), forces[3:6]]), 32),
    ):
        rows = rows.astype(np.float32)
        assert in_c(sensor, rows)[-1, 2] == bit
        module = module_of(tmp_path, sensor)["Press"]()
        for row in rows.tolist():
            module.add(row)
        assert module.read() == (None, None, bit)
    loud = replace(sensor.report, read_out=replace(sensor.report.read_out, signal=None))
    noisy = replace(sensor, report=loud, unit=sensor.unit)
    noisy = replace(
        noisy,
        report=replace(loud, design=replace(loud.design, reading=replace(loud.design.reading, noise_percent=5.0))),
    )
    rows = forces.astype(np.float32)
    (E, bit), module = both(noisy, rows, tmp_path)
    assert (E, bit) == module == (None, 64)
    assert in_c(noisy, rows)[-1, 2] == 64
    assert in_c(sensor, np.zeros((3, 4), dtype=np.float32))[-1, 2] == 2
    assert module_of(tmp_path, sensor)["Press"]().read() == (None, None, 2)


def test_radii_that_are_told_are_in_the_firmware(mango, tmp_path, in_c):
    plain = mango.measuring()
    sensor = replace(plain, radii_mm=(35.0, 60.0))
    travels = (np.linspace(0.1, 1.0, 30) * mango.design.press.travel_mm).tolist()
    rows = mango.forces([Pose(E=1.0, travel=x) for x in travels]).astype(np.float32)
    (expected, bit), module = both(sensor, rows, tmp_path)
    assert abs(expected / both(plain, rows, tmp_path)[0][0] - 1.0) > 0.01
    assert module == (pytest.approx(expected, rel=1e-9), bit)
    assert in_c(sensor, rows)[-1, 0] == pytest.approx(expected, rel=AGREES)


@pytest.mark.parametrize("creep", [0.0, 0.025])
@pytest.mark.parametrize("level_rows", [1, 9])
def test_factor_of_a_ball_is_in_the_firmware(level_rows, creep, mango, tmp_path, in_c):
    """With any number of level readings, and springs that creep between weights and presses."""
    sensor = mango.measuring()
    read_out = replace(sensor.report.read_out, rise_level=sensor.report.read_out.rise_level[:level_rows])
    unit = replace(sensor.unit, creep_per_decade=creep, creep_error=0.4 * creep)
    plain = replace(sensor, unit=unit, report=replace(sensor.report, read_out=read_out))
    ball = BallCorrection(
        factor=1.13,
        percent=2.0,
        E_MPa=1.3,
        radius_mm=40.0,
        press_s=3.0,
        spring_slopes=(0.0,) * 4,
        gain_slopes=(0.0,) * 4,
        form_percent=(0.0,) * 3,
    )
    corrected = replace(plain, unit=replace(unit, ball=ball))
    travels = (np.linspace(0.1, 1.0, 30) * mango.design.press.travel_mm).tolist()
    rows = mango.forces([Pose(E=1.0, travel=x) for x in travels]).astype(np.float32)
    (told, bit), module = both(corrected, rows, tmp_path)
    expected = 1.13 * both(plain, rows, tmp_path)[1][0]
    assert module == (pytest.approx(expected, rel=1e-9), bit)
    assert in_c(corrected, rows)[-1, 0] == pytest.approx(expected, rel=AGREES)
    if not creep:  # firmware takes the duration of the design's press, the command that of the log
        assert told == pytest.approx(expected, rel=1e-9)


@pytest.mark.study
def test_press_of_a_line_of_flat_tips_agrees(rng, tmp_path, in_c):
    line = MeasuredDesign("docs/examples/fouly.toml", assessed=False)
    sensor = line.measuring()
    travels = (np.linspace(0.1, 1.0, 40) * line.design.press.travel_mm).tolist()
    for E in (0.6, 3.0):
        rows = line.forces([Pose(E=E, travel=x) for x in travels])
        rows = (rows + rng.normal(size=rows.shape) * sensor.noises).astype(np.float32)
        (expected, bit), module = both(sensor, rows, tmp_path)
        assert module == (pytest.approx(expected, rel=1e-9), bit)
        assert in_c(sensor, rows)[-1].tolist()[::2] == [pytest.approx(expected, rel=AGREES), bit]


@pytest.fixture(scope="module")
def curved():
    """Return the pair on a round fruit."""
    return MeasuredDesign("paper-on-mango", assessed=False)


@pytest.fixture(params=["paper", "curved"])
def pair(request):
    return request.getfixturevalue(request.param)


@pytest.mark.parametrize("samples", [10, pytest.param(1000, marks=pytest.mark.study)])
def test_press_of_a_pair_agrees_sample_for_sample(samples, pair, rng, tmp_path, in_c):
    """Random tilts, there and back, with noise and air beside; of tips that lean the part in which they are seated."""
    sensor = pair.measuring(FACTORS["paper"])
    travel = pair.design.press.travel_mm
    flags = set()
    seated = 0
    for E in np.exp(rng.uniform(math.log(0.5), math.log(3.5), 4)).tolist():
        x = np.concatenate([np.linspace(0.15, 1.0, samples), np.linspace(0.9, 0.5, 3)]) * travel
        steps = np.linspace(0.15, 1.0, 30) * travel
        tilt = (rng.uniform(-1.0, 1.0), 0.0)
        forces = pair.forces(
            [Pose(E=E, travel=at, stand=Stand(tilt_deg=tilt)) for at in steps.tolist()], FACTORS["paper"]
        )
        rows = np.column_stack([np.interp(x, steps, row) for row in forces.T])
        rows = rows + 0.3 * rng.normal(size=rows.shape) * sensor.noises
        rows = np.concatenate([np.zeros((3, 2)), rows, np.zeros((3, 2))]).astype(np.float32)
        (expected, bit), module = both(sensor, rows, tmp_path)
        assert module == (pytest.approx(expected, rel=1e-9), bit)
        found, _, found_bits = in_c(sensor, rows)[-1].tolist()
        assert (found, found_bits) == (pytest.approx(expected or math.nan, rel=AGREES, nan_ok=True), bit)
        flags.add(bit)
        touching = [row for row in rows.astype(float) if (row > sensor.least_forces).all()]
        count = read_press(sensor, touching).samples
        seated += count is not None and count < len(touching) - 4  # those on the way back and the first one
    assert 0 in flags
    assert seated or samples == 10


@pytest.mark.parametrize("name", ["paper", "mango"])
def test_flags_agree_on_odd_forces(name, request, rng, tmp_path, in_c):
    """At once, with no delay between channels."""
    measured = request.getfixturevalue(name)
    sensor = measured.measuring(FACTORS[name])
    at_once = replace(sensor.report, read_out=replace(sensor.report.read_out, signal=None))
    sensor = replace(sensor, report=at_once)
    rows = at_random(rng, len(measured.K))
    expected = [bits(flags_of_forces(sensor, sensor.forces_of_channels(row))) for row in rows.astype(float)]
    assert in_c(sensor, rows)[:-1, 2].tolist() == expected
    press = module_of(tmp_path, sensor)["Press"]
    assert [press().add(row) for row in rows.tolist()] == expected
    assert in_c(sensor, rows[:0])[0, 2] == 2


@pytest.mark.parametrize("count", [1, 2])
def test_firmware_of_few_level_rows_agrees(count, mango, tmp_path, in_c):
    """One row shifts every modulus alike."""
    sensor = mango.measuring()
    read_out = replace(sensor.report.read_out, rise_level=sensor.report.read_out.rise_level[:count])
    sensor = replace(sensor, report=replace(sensor.report, read_out=read_out))
    travels = (np.linspace(0.1, 1.0, 30) * mango.design.press.travel_mm).tolist()
    rows = mango.forces([Pose(E=1.0, travel=x) for x in travels]).astype(np.float32)
    (expected, bit), module = both(sensor, rows, tmp_path)
    assert module == (pytest.approx(expected, rel=1e-9), bit)
    assert in_c(sensor, rows)[-1, 0] == pytest.approx(expected, rel=AGREES)


@pytest.mark.parametrize("design", ["mango", "paper"])
def test_a_unit_has_every_constant_that_the_core_declares(design, request, tmp_path):
    given = module_of(tmp_path, request.getfixturevalue(design).measuring())["UNIT"]
    assert vars(given).keys() - {"size"} == Unit.__annotations__.keys()


def test_core_imports_what_a_board_has():
    tree = ast.parse(Path(press_core.__file__).read_text(encoding="utf-8"))
    imported = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [[alias.name for alias in node.names] for node in imported] == [["math"]]


def test_press_is_over_after_more_firm_samples_than_one_bad_conversion_makes(paper, tmp_path):
    module = module_of(tmp_path, paper.measuring())
    unit = module["UNIT"]
    firm = [2.0 * unit.firm * least for least in unit.least_forces]
    for count in (unit.several, unit.several + 1):
        press = module["Press"]()
        for row in [firm] * count + [[0.0] * unit.size] * (unit.several + 1):
            press.add(row)
        assert press.over == (count > unit.several)

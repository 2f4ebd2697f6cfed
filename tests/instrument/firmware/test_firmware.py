"""Firmware compiled by the system's compiler, or run by the interpreter, reads as `pipeline read` does."""

import ast
import math
from pathlib import Path

import numpy as np
import pytest
from firmware_presses import FACTORS, PRESSES, forces_of
from measured_units import (
    READ_IN_C,
    as_firmware,
    bits,
    module_of,
    printed_by_header,
    read_by_module,
    read_in_c,
    read_log,
    with_read_out,
)

from instrument.press import press_core
from instrument.press.fruit_of_presses import fruit_answer
from instrument.press.fruit_reading import flags_of_forces
from instrument.press.press_core import Unit

AGREES = 1e-5  # single precision over a thousand samples


@pytest.mark.parametrize(
    "press",
    [
        pytest.param(press, id=press["name"], marks=pytest.mark.study if press["design"] == "line" else ())
        for press in PRESSES
    ],
)
def test_command_module_and_header_read_a_stored_press_alike(press, unit_of, tmp_path):
    sensor, forces = unit_of(press), forces_of(press)
    reading = read_log(sensor, forces)
    expected = as_firmware(reading)
    assert (expected.flags, expected.left_out) == (press["flags"], press["left_out"])
    if press["E"] is not None:
        assert abs(reading.E / (press["E"] * sensor.ball_factor) - 1.0) <= reading.u
    assert read_by_module(sensor, forces) == pytest.approx(expected, rel=1e-9, nan_ok=True)
    assert read_in_c(tmp_path, sensor, forces) == pytest.approx(expected, rel=AGREES, nan_ok=True)


@pytest.mark.parametrize("name", FACTORS)
def test_a_thousand_noisy_samples_are_read_alike(name, designs, rng, tmp_path):
    """The running sums of single precision do not drift; tips that lean are read by the part that is seated."""
    measured = designs(name)
    sensor = measured.measuring(FACTORS[name])
    shares = np.linspace(0.15, 1.0, 30)
    forces = measured.press(1.2, shares, FACTORS[name])
    rows = np.column_stack([np.interp(np.linspace(0.15, 1.0, 1000), shares, tip) for tip in forces.T])
    rows = (rows + 0.3 * rng.normal(size=rows.shape) * sensor.noises).astype(np.float32)
    expected = as_firmware(read_log(sensor, rows))
    assert expected.flags == 0
    assert read_by_module(sensor, rows) == pytest.approx(expected, rel=1e-9)
    assert read_in_c(tmp_path, sensor, rows) == pytest.approx(expected, rel=AGREES)


FRUIT = """
#include <stdio.h>
#include "unit.h"
int main(void)
{
    float f[TWINTIP_TIPS];
    twintip_press press;
    twintip_one_fruit fruit = {0};
    twintip_begin(&press);
    while (fread(f, sizeof f, 1, stdin) == 1) {
        if (f[0] == f[0]) {
            twintip_add(&press, f);
            continue;
        }
        const twintip_reading each = twintip_end(&press);
        twintip_fruit_add(&fruit, &each);
        twintip_begin(&press);
        const twintip_fruit_reading found = twintip_fruit_read(&fruit);
        printf("%.9g %.9g %.9g %u %u\\n", (double)found.E, (double)found.E_reduced, (double)found.scatter,
               (unsigned)found.flags, (unsigned)found.presses);
    }
    return 0;
}
"""
"""Reads presses, each with a row of no numbers behind it, and tells the fruit after each of them."""


@pytest.mark.parametrize("wide", [0.02, 0.25])
def test_fruit_of_one_to_ten_presses_agrees(wide, mango, rng, tmp_path):
    """Presses of moduli that scatter; firmware keeps the last eight. The third tells nothing."""
    sensor = mango.measuring()
    module = module_of(sensor)
    fruit = module["Fruit"]()
    rows, presses, expected = [], [], []
    for number, E in enumerate(np.exp(wide * rng.normal(size=10)).tolist()):
        forces = mango.press(E, np.linspace(0.1, 1.0, 2 if number == 2 else 30))
        forces = (forces + rng.normal(size=forces.shape) * sensor.noises).astype(np.float32)
        rows += [forces, np.full((1, 4), math.nan)]
        presses.append(read_log(sensor, forces))
        told = fruit_answer(sensor, [each for each in presses if each.E is not None][-8:], "1")
        expected.append([told.E, told.reduced, told.scatter or 0.0, bits(told.flags), told.counted])
        press = module["Press"]()
        for row in forces.astype(float).tolist():
            press.add(row)
        fruit.add(press.read()[0], press.noise)
        assert fruit.read() == pytest.approx(expected[-1][:4], rel=1e-9)
    in_c = printed_by_header(tmp_path, sensor, FRUIT, np.concatenate(rows).astype(np.float32))
    assert in_c == pytest.approx(np.array(expected), rel=AGREES, abs=AGREES)
    assert expected[-1][3:] == [256 if wide > 0.1 else 0, 8]


@pytest.mark.parametrize("name", ["paper", "mango"])
def test_flags_agree_on_odd_forces(name, designs, rng, tmp_path):
    """NaN, infinite, negative, huge, zero; at once, with no delay between channels."""
    measured = designs(name)
    sensor = with_read_out(measured.measuring(FACTORS[name]), signal=None)
    rows = rng.uniform(-0.2, 1.5, (1000, len(measured.K))) * 10.0 ** rng.uniform(-2.0, 0.5, (1000, len(measured.K)))
    chosen = rng.random(rows.shape) < 0.1
    rows[chosen] = rng.choice([math.nan, math.inf, -math.inf, -1.0, 1e30, 0.0, -0.0], chosen.sum())
    rows = rows.astype(np.float32)
    expected = [bits(flags_of_forces(sensor, sensor.forces_of_channels(row))) for row in rows.astype(float)]
    assert printed_by_header(tmp_path, sensor, READ_IN_C, rows)[:-1, 2].tolist() == expected
    press = module_of(sensor)["Press"]
    assert [press().add(row) for row in rows.tolist()] == expected


@pytest.mark.parametrize("name", ["mango", "paper"])
def test_a_unit_has_every_constant_that_the_core_declares(name, designs):
    given = module_of(designs(name).measuring())["UNIT"]
    assert vars(given).keys() - {"size"} == Unit.__annotations__.keys()


def test_core_imports_what_a_board_has():
    tree = ast.parse(Path(press_core.__file__).read_text(encoding="utf-8"))
    imported = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [[alias.name for alias in node.names] for node in imported] == [["math"]]


def test_press_is_over_after_more_firm_samples_than_one_bad_conversion_makes(paper):
    module = module_of(paper.measuring())
    unit = module["UNIT"]
    firm = [2.0 * unit.firm * least for least in unit.least_forces]
    for count in (unit.spike_length, unit.spike_length + 1):
        press = module["Press"]()
        for row in [firm] * count + [[0.0] * unit.size] * (unit.spike_length + 1):
            press.add(row)
        assert press.over == (count > unit.spike_length)

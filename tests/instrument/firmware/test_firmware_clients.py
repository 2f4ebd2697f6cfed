"""Firmware as its users build it: strict C and C++, microcontrollers in emulators, the MicroPython interpreter."""

import re
import runpy
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from boards import BOARDS
from deadline import DEADLINE_S
from firmware_presses import PRESSES, forces_of
from measured_units import read_log

from instrument.firmware.firmware import render_board_files, render_header, render_module
from instrument.press.presses import TARE_SAMPLES

pytestmark = pytest.mark.slow

AGREES = 1e-5  # single precision over the samples of a press
INTERPRETER = Path(__file__).parents[3] / ".ci" / "micropython"
PROGRAM = """
#include "unit.h"
void say(const char *line);
static const float rows[SAMPLES][TWINTIP_TIPS] = {
ROWS
};
static void say_word(uint32_t word)
{
    char text[] = "reads 00000000\\n";
    for (int digit = 13; digit > 5; --digit, word >>= 4) {
        text[digit] = "0123456789abcdef"[word & 15u];
    }
    say(text);
}
int main(void)
{
    union { float number; uint32_t word; } E;
    twintip_press press;
    twintip_begin(&press);
    for (int row = 0; row < SAMPLES; ++row) {
        twintip_add(&press, rows[row]);
    }
    const twintip_reading found = twintip_end(&press);
    E.number = found.E;
    say_word(E.word);
    say_word(found.flags);
    return 0;
}
"""
IN_PYTHON = """
import unit
press = unit.Press()
for row in {rows}:
    press.add(row)
print(press.read()[0])
"""
FRUIT_IN_PYTHON = """
import unit
fruit = unit.Fruit()
for number in range(10):
    fruit.add(1.0 + 0.03 * number * number, 0.01)
    print(*fruit.read())
"""
DEMONSTRATION = """
import sys, unit
sys.argv[:] = ["unit.py", "counts.csv"]
unit.main()
"""
MACHINE = """
class Pin:
    OUT, IN = 1, 0
    def __init__(self, number, mode=0, value=None):
        pass
    def value(self, *level):
        return 0
class SPI:
    left = 40
    def __init__(self, number, baudrate, polarity, phase, sck, mosi, miso):
        pass
    def write_readinto(self, written, taken):
        if written[0] == 0x43:
            self.settings = bytes(written[1:])
        elif written[0] == 0x23:
            taken[1:] = self.settings
        elif written[0] == 0x40:
            self.input = (written[1] >> 4) - 8
        elif written[0] == 0x10:
            SPI.left -= 1
            if SPI.left < 0:
                raise KeyboardInterrupt
            taken[1:] = ((-1000 * self.input) % (1 << 24)).to_bytes(3, "big")
"""
"""A converter whose inputs show no counts, -1000, -2000 and so on, until it has shown forty."""
ON_BOARD = f"""
with open("machine.py", "w") as file:
    file.write({MACHINE!r})
import unit
try:
    unit.main()
except KeyboardInterrupt:
    print("end")
"""
NEWTONS_PER_COUNT = 1e-6
IN_NODE = """
import {{ loadMicroPython }} from "{interpreter}";
import {{ readFileSync }} from "node:fs";
const board = await loadMicroPython({{ heapsize: 65536, linebuffer: true }});
for (const name of ["unit.py", "counts.csv", "program.py"]) {{
    board.FS.writeFile(name, readFileSync(name));
}}
board.runPython(readFileSync("program.py", "utf-8"));
"""


PRESS_OF = {press["name"]: press for press in PRESSES}
USUAL = ("paper of 1.2 MPa, tilted by 0.5 degrees", "mango of 1.2 MPa, tilted by 1.9 degrees")
OTHERS = (
    "a deep touch after one of less force",
    "paper-on-mango of 2.1 MPa, tilted by 0.9 degrees",
    "unit: ball and creep",
    "pair, channels in turn",
    "mango with a sample that is zero",
)


@pytest.fixture(params=USUAL)
def press(request, unit_of):
    """Return a unit and the forces [N] of one stored press, (samples, tips) in single precision."""
    press = PRESS_OF[request.param]
    return unit_of(press), forces_of(press)


@pytest.mark.parametrize(
    ("compiler", "file", "standard"),
    [("gcc", "main.c", "c99"), ("g++", "main.cpp", "c++17")],
)
def test_header_compiles_without_a_warning(compiler, file, standard, press, tmp_path):
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    sensor, forces = press
    (tmp_path / "unit.h").write_text(render_header(sensor), encoding="utf-8")
    (tmp_path / file).write_text(program_of(forces), encoding="utf-8")
    words = [f"-std={standard}", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-pedantic", "-O2", "-c", file]
    subprocess.run([compiler, *words], check=True, cwd=tmp_path, timeout=DEADLINE_S)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.name)
def test_microcontroller_reads_what_the_command_reads(board, press, tmp_path):
    board.skip_without_programs()
    sensor, forces = press
    (tmp_path / "unit.h").write_text(render_header(sensor), encoding="utf-8")
    said = board.said(tmp_path, program_of(forces))
    words = [int(word, 16) for word in re.findall(r"reads ([0-9a-f]{8})", said)]
    assert len(words) == 2
    E = np.array(words[:1], dtype=np.uint32).view(np.float32)[0]
    assert words[1] == 0
    assert pytest.approx(E, rel=AGREES) == read_log(sensor, forces).E


@pytest.mark.parametrize("press", [*USUAL, *OTHERS], indirect=True)
def test_micropython_reads_what_the_command_reads(press, tmp_path):
    """The real interpreter, in doubles of its own: E to the digits of its numbers."""
    sensor, forces = press
    rows = forces.astype(float).tolist()
    E = float(said_by_micropython(tmp_path, sensor, IN_PYTHON.format(rows=rows)))
    assert pytest.approx(E, rel=1e-9) == read_log(sensor, forces).E


def test_interpreter_reads_a_fruit_of_one_to_ten_presses(press, tmp_path):
    """As the module in Python does."""
    sensor, _ = press
    lines = said_by_micropython(tmp_path, sensor, FRUIT_IN_PYTHON).splitlines()
    fruit = runpy.run_path(str(tmp_path / "unit.py"))["Fruit"]()
    for number, line in enumerate(lines):
        fruit.add(1.0 + 0.03 * number * number, 0.01)
        assert list(map(float, line.split())) == pytest.approx(fruit.read(), rel=1e-9)
    assert len(lines) == 10


def test_demonstration_reads_recorded_counts(press, tmp_path):
    """Its main function, fed a file of counts, in the interpreter of the board."""
    sensor, forces = press
    matrix = tuple(map(tuple, (NEWTONS_PER_COUNT * np.eye(forces.shape[1])).tolist()))
    zeros = (0.0,) * len(matrix)
    unit = replace(sensor.unit, newtons_per_count=matrix, zero_counts=zeros, saturation_counts=2**23 - 1)
    counts = np.rint(forces / NEWTONS_PER_COUNT).astype(int)
    rows = np.concatenate([np.zeros((TARE_SAMPLES, forces.shape[1]), int), counts]).tolist()
    recorded = "".join(",".join(map(str, row)) + "\n" for row in rows)
    said = said_by_micropython(tmp_path, replace(sensor, unit=unit), DEMONSTRATION, recorded)
    E, flags = re.fullmatch(r"E (\S+) MPa, .+, flags (\d+)\n", said).groups()
    assert flags == "0"
    assert float(E) == pytest.approx(read_log(sensor, counts * NEWTONS_PER_COUNT).E, rel=AGREES)


@pytest.mark.parametrize("calibrated", [False, True])
def test_programs_of_the_board_run_in_the_interpreter(calibrated, mango, tmp_path):
    sensor = mango.measuring()
    if calibrated:
        matrix = tuple(map(tuple, (NEWTONS_PER_COUNT * np.eye(4)).tolist()))
        unit = replace(sensor.unit, newtons_per_count=matrix, zero_counts=(0.0,) * 4, saturation_counts=2**23 - 1)
        sensor = replace(sensor, unit=unit)
    program = render_board_files(sensor, calibrated=calibrated)["main.py"]
    first, *lines = said_by_micropython(tmp_path, sensor, ON_BOARD, text=program).splitlines()
    if calibrated:
        assert (first.partition(":")[0], lines) == ("taring", ["end"])
    else:
        assert first == "t_us,counts_1,counts_2,counts_3,counts_4"
        assert [line.partition(",")[2] for line in lines] == ["0,-1000,-2000,-3000"] * 10 + [""]


def program_of(forces):
    """Return the C program that reads a press of forces that stand in it."""
    rows = ",\n".join("{" + ", ".join(f"{force:.9e}f" for force in row) + "}" for row in forces)
    return PROGRAM.replace("ROWS", rows).replace("SAMPLES", str(len(forces)))


def said_by_micropython(folder, sensor, program, counts="", text=None):
    """Return what a program says in the MicroPython interpreter, the module of a unit beside it."""
    interpreter = INTERPRETER / "node_modules/@micropython/micropython-webassembly-pyscript/micropython.mjs"
    if shutil.which("node") is None or not interpreter.exists():
        pytest.skip("no MicroPython interpreter: npm ci --prefix .ci/micropython")
    (folder / "unit.py").write_text(text or render_module(sensor), encoding="utf-8")
    (folder / "counts.csv").write_text(counts, encoding="utf-8")
    (folder / "program.py").write_text(program, encoding="utf-8")
    (folder / "run.mjs").write_text(IN_NODE.format(interpreter=interpreter.as_uri()), encoding="utf-8")
    ended = subprocess.run(
        ["node", "run.mjs"], cwd=folder, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=True
    )
    return ended.stdout

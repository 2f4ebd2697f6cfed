import re
import shlex
import shutil
import subprocess
from dataclasses import replace

import pytest
from deadline import DEADLINE_S
from gcode import sliced
from squares import RESIN, square_sensor, with_seats

from cad.drawing.sheet import Title
from cad.fabrication.bill import bill_of_materials
from cad.fabrication.fabrication_files import write_fabrication
from cad.fabrication.fabrication_sheet import fabrication_sheet
from cad.files.sensor_files import write_sensor
from cad.files.slicer_settings import slicer_settings
from cad.files.stl import read_stl
from cad.files.threemf import read_3mf
from cad.parts.assembly import assemble_sensor
from cad.parts.coupon import modulus_factor
from cad.parts.hall_seats import hall_seats
from sensor.design.bench import Bench
from sensor.design.fruit import Fruit
from sensor.design.processes import PROCESSES
from sensor.design.readout import Readout
from sensor.design.signal_path import SpringReadOut, SpringToRead, signal_path

TITLE = Title(name="paper", process=PROCESSES["fdm-petg"])
FILES = ["housing.step", "assembly.step", "housing.stl", "housing.3mf", "assembly.glb"]
SHEETS = [
    "drawing.dxf", "drawing.svg", "drawing.pdf", "coupon.step", "coupon.stl", "cover.step", "cover.stl", "mount.step",
    "mount.stl", "plate.3mf", "exploded.svg", "bom.csv", "fabrication.md",
]  # fmt: skip


def springs_of(sensor):
    """Return springs of 900 and 20000 N/m that move by 0.5 and 0.1 mm."""
    rows = zip(sensor.housing.arms, (0.9, 20.0), (0.5, 0.1), strict=True)
    return tuple(SpringToRead(name=arm.name, K=K, deflection=d) for arm, K, d in rows)


def sheet_of(sensor, title=TITLE, signal=None, folder="OUT", **read_out):
    masses = dict.fromkeys(("housing", "cover", "coupon", "mount"), 1.0)
    bill = bill_of_materials(sensor, assemble_sensor(sensor), title.process, masses)
    springs = springs_of(sensor)
    described = SpringReadOut(springs=springs, signal=signal, folder=folder, **read_out)
    return fabrication_sheet(sensor, title, bill, described, (189.3, 150.0))


@pytest.fixture(scope="module")
def curved(sensor):
    """Return the sensor between its covers, over a curved fruit, with its name engraved."""
    fruit = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
    return replace(sensor, name="paper", fruit=fruit, housing=replace(sensor.housing, mount="covers"))


def write_all(sensor, folder):
    """Return the paths of every file in their order."""
    paths = write_sensor(sensor, folder, slicer_settings(TITLE.process, sensor.housing)).paths
    return [*paths, *write_fabrication(sensor, TITLE, SpringReadOut(springs=springs_of(sensor)), folder).paths]


@pytest.fixture(scope="module")
def written(curved, tmp_path_factory):
    return write_all(curved, tmp_path_factory.mktemp("fabrication"))


@pytest.mark.slow
def test_every_file_is_written_and_the_same_bytes_again_but_for_step(curved, written, tmp_path):
    """OCCT counts in its text: its files hold equal solids, not equal bytes."""
    again = write_all(curved, tmp_path)
    assert [path.name for path in written] == [path.name for path in again] == [*FILES, *SHEETS]
    for path, other in zip(written, again, strict=True):
        assert path.suffix == ".step" or path.read_bytes() == other.read_bytes()


ALLOY = replace(PROCESSES["dmls-ti64"], name="dmls-316l", material="316L")
THICK_LAYERS = replace(TITLE.process, name="thick-layers", layer_mm=0.35)
MILLED = replace(RESIN, name="milled", kind="other")
PROCESSES_TOLD = [  # process, what its sheet tells, what it does not
    (
        TITLE.process,
        ("Nozzle 0.4 mm", "L leaves are 2 lines, H leaves 3", "190 x 150 mm of the bed"),
        ("isopropanol", "argon", "Two plates", "mm deep instead"),
    ),
    (THICK_LAYERS, ("5.95 mm deep instead of 6 mm", "by -0.83 %"), ()),  # 17 layers of 0.35 mm
    (RESIN, ("isopropanol", "30 min at 60 C"), ("Nozzle", "argon", "brim", "A slicer counts")),
    (PROCESSES["sls-pa12"], ("powder out of every gap", "2 bar"), ("Nozzle", "isopropanol", "argon", "brim")),
    (PROCESSES["dmls-17-4ph"], ("H900, 480 C for 1 h", "by wire AFTER the heat"), ("argon", "No support", "brim")),
    (PROCESSES["dmls-ti64"], ("650 to 750", "argon"), ("H900", "No support", "brim")),
    (ALLOY, ("by the cycle that the maker of the powder gives",), ("argon",)),
    (MILLED, ("## Make",), ("Nozzle", "isopropanol")),
]
MOUNTS_TOLD = [  # whether it is a square, mount, whether it has a Hall read-out, what its sheet tells and does not
    (False, "covers", False, ("M3 x 25", "M3 x 16."), ("(ISO 7089)", "## Hall")),
    (False, "washers", False, ("7 mm wide (ISO 7089)", "M3 x 10."), ("to grip\n", "cover.stl")),
    (
        True,
        "covers",
        False,
        ("3 m6 x 10 mm (ISO 8734)", "holes of 2.95 mm", "domes of radius 10 mm"),
        ("Zero the tips",),
    ),
    (False, "covers", True, ("windows of the front cover",), ("an arm of the", "bracket has")),
    (True, "covers", True, ("bracket has a window",), ("an arm of the", "of the front cover")),
    (False, "washers", True, ("an arm of the bracket", "cut a window"), ("of its cover", "bracket has a window")),
]


def disagreement(text, told, absent):
    """Return what a sheet leaves out of what it must tell, and what it tells of what it must not."""
    return [part for part in told if part not in text], [part for part in absent if part in text]


@pytest.mark.parametrize(("process", "told", "absent"), PROCESSES_TOLD, ids=lambda told: getattr(told, "name", None))
def test_sheet_is_true_to_its_process(process, told, absent, sensor):
    text = sheet_of(sensor, replace(TITLE, process=process))
    assert disagreement(text, told, absent) == ([], [])
    assert not re.search(r"[^\n]\n## |\n\n\n+## ", text)  # one empty line before each heading


def signal_of(seated, process=TITLE.process):
    return signal_path(Readout(), springs_of(seated), process, seated.tips.springs)


@pytest.mark.parametrize(("is_square", "mount", "has_seats", "told", "absent"), MOUNTS_TOLD)
def test_sheet_is_true_to_its_mount_and_read_out(is_square, mount, has_seats, told, absent, sensor):
    shown = square_sensor() if is_square else sensor
    shown = replace(shown, housing=replace(shown.housing, mount=mount))
    if has_seats:
        shown = replace(shown, seats=hall_seats(shown.housing, shown.press, TITLE.process))
    text = sheet_of(shown, signal=signal_of(shown) if has_seats else None)
    assert disagreement(text, told, absent) == ([], [])


def test_sheet_tells_how_far_pins_stand_out_of_their_feet(pinned):
    """As far as the lower ends of the pins lie below the printed part in the assembly."""
    assembly = assemble_sensor(pinned)
    part, pin = (assembly.objects[name] for name in ("housing", "low_pin"))
    lowest = [each.toCompound().BoundingBox().zmin for each in (part, pin)]
    (shown,) = re.findall(r"and the feet\n([0-9.]+) mm above the plate", sheet_of(pinned))
    assert float(shown) == pytest.approx(lowest[0] - lowest[1], abs=0.005)  # two decimals are shown


@pytest.mark.parametrize(
    ("bench", "digits"),
    [(None, ["0.001", "0.1", "0.0001", "1"]), (Bench(dial_mm=0.02, balance_g=0.5), ["0.02", "0.5", "0.02", "0.5"])],
    ids=["what K to 1 % needs", "that of the design"],
)
def test_sheet_has_the_last_digits_of_the_bench(bench, digits, sensor):
    """Rows of the low and the high spring, which end with those of dial and balance."""
    lines = sheet_of(sensor, bench=bench).partition("| balance to g |")[2].splitlines()[2:4]
    assert [cell for line in lines for cell in line.strip(" |").split(" | ")[-2:]] == digits


@pytest.mark.parametrize(
    ("attitude", "difference", "expected", "absent"),
    [
        (
            "side",
            1.6,
            ("change by 1.6 mm", "its tips pointing to the side**", "row without weight"),
            (),
        ),
        ("side", 0.02, ("change by 0.02 mm",), ("**Hold", "row without weight")),
        ("down", 1.6, ("its tips pointing down**",), ("row without weight", "to the side,")),
    ],
)
def test_sheet_states_the_attitude_of_the_design_and_the_effect_of_another(attitude, difference, expected, absent):
    """A tenth of the travel is 0.04 mm. On the bench the tips point down: another attitude has another zero there."""
    square = square_sensor()
    sensor = with_seats(replace(square, press=replace(square.press, attitude=attitude)), RESIN)
    text = sheet_of(sensor, signal=signal_of(sensor), height_difference_down=difference)
    assert disagreement(text.partition("## From the bench")[0], expected, absent) == ([], [])


@pytest.mark.parametrize(("presses", "expected"), [(1, "2"), (3, "3"), (4, "4")])
def test_sheet_reads_as_many_presses_of_a_fruit_as_the_design(presses, expected):
    sensor = with_seats(square_sensor(), RESIN)
    text = sheet_of(sensor, signal=signal_of(sensor), presses=presses)
    assert re.findall(r"--fruit-presses (\d+)|press each fruit (\d+) times", text) == [("", expected), (expected, "")]


SKIN = {"skin_mm": 0.2, "skin_E_MPa": 20.0}


@pytest.mark.parametrize(("fruit", "told"), [({}, True), (SKIN, False)])
def test_sheet_names_a_ball_where_a_unit_takes_one(fruit, told):
    """The form of the domes may be off by what their process makes of an outline, whatever the sensor is."""
    square = square_sensor()
    sensor = with_seats(replace(square, fruit=replace(square.fruit, **fruit)), RESIN)
    text = sheet_of(sensor, Title(name="gentle-square", process=RESIN), signal_of(sensor, RESIN))
    assert ("--ball" in text) == told
    good, within = re.findall(r"(?:lies|outlines)\s+within ([\d.]+) mm", text)
    assert float(good) == float(within) == RESIN.accuracy_mm
    assert not re.search(r"reads E \d", text)


@pytest.mark.parametrize("folder", ["outputs/hx", "my designs/hx 2"])
def test_commands_of_the_sheet_name_the_folder_that_was_written(folder, sensor):
    seated = with_seats(sensor, TITLE.process)
    text = sheet_of(seated, signal=signal_of(seated), folder=folder)
    commands = [shlex.split(line) for line in text.splitlines() if line.lstrip().startswith("pipeline ")]
    assert {words[1] for words in commands} == {"calibrate", "read"}
    assert {words[2] for words in commands} == {folder}


def test_sheet_of_a_part_has_its_numbers(sensor):
    volume = 1e-3 * sensor.part.shape.Volume()
    factor = f"{modulus_factor(sensor.housing.low):.5g}"
    text = sheet_of(sensor)
    assert f"{volume:.2f} cm3, {1.27 * volume:.1f} g" in text
    assert factor in text
    found = re.search(r"A slicer counts ([\d.]+) to ([\d.]+) g", text)
    assert found is not None
    assert [float(grams) for grams in found.groups()] == pytest.approx(
        [0.99 * 1.27 * volume, 1.04 * 1.27 * volume], abs=0.05
    )


PRINTED = {
    "layer": 0.2,
    "line width": 0.4,
    "filled": True,
    "rectilinear": True,
    "perimeters": 2,
    "foot": 0.15,
    "support or brim": False,
}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
def test_slicer_prints_a_plate_by_its_settings_and_an_stl_by_the_profile(written, tmp_path):
    """The profile has other settings: they are read back from the lines of the housing without settings."""
    plate, bare = (written[0].with_name(name) for name in ("plate.3mf", "housing.stl"))
    profile = ("--brim-width", "3", "--bed-shape", "0x0,180x0,180x180,0x180")
    lines = sliced(plate, tmp_path, "--dont-arrange", "--gcode-label-objects", *profile)
    assert lines.settings(read_3mf(plate).mesh.volume) == PRINTED
    assert set(lines.objects) == {"housing", "cover 1", "cover 2", "coupon", "mount"}
    other = sliced(bare, tmp_path, *profile).settings(read_stl(bare).volume)
    assert [name for name, setting in PRINTED.items() if other[name] == setting] == []


@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
def test_every_setting_is_one_that_the_slicer_knows(sensor):
    """It ignores the others in silence."""
    command = ["prusa-slicer", "--help-fff"]
    told = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=True).stdout
    known = set(re.findall(r"--([a-z-]+)", told))
    assert {key.replace("_", "-") for key in slicer_settings(TITLE.process, sensor.housing)} <= known

import itertools
import math
import re
import shlex
import shutil
import subprocess
from dataclasses import replace

import cadquery as cq
import pytest
from deadline import DEADLINE_S
from gcode import FILAMENT_MM, sliced
from squares import RESIN, square_sensor, with_seats

from cad.checks.assembly_checks import cover_verdicts
from cad.checks.part_checks import check_file
from cad.drawing.sheet import Title
from cad.fabrication.bill import bill_of_materials
from cad.fabrication.fabrication_files import write_fabrication
from cad.fabrication.fabrication_sheet import fabrication_sheet
from cad.fabrication.mount_checks import mount_verdicts
from cad.files.sensor_files import write_sensor
from cad.files.slicer_settings import slicer_settings
from cad.files.stl import read_stl
from cad.files.threemf import read_3mf
from cad.parts.coupon import modulus_factor
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


def sheet_of(sensor, title=TITLE, signal=None, folder="OUT", bench=None):
    masses = dict.fromkeys(("housing", "cover", "coupon", "mount"), 1.0)
    bill = bill_of_materials(sensor, title.process, masses)
    read_out = SpringReadOut(springs=springs_of(sensor), signal=signal, bench=bench, folder=folder)
    return fabrication_sheet(sensor, title, bill, read_out)


@pytest.fixture(scope="module")
def curved(sensor):
    """Return the sensor between its covers, over a curved fruit, with its name engraved."""
    fruit = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)
    return replace(sensor, name="paper", fruit=fruit, housing=replace(sensor.housing, mount="covers"))


def write_all(sensor, folder):
    """Return the paths of every file in their order, and cover and bracket as they were read back."""
    paths = write_sensor(sensor, folder, slicer_settings(TITLE.process, sensor.housing)).paths
    made = write_fabrication(sensor, TITLE, SpringReadOut(springs=springs_of(sensor)), folder)
    return [*paths, *made.paths], made


@pytest.fixture(scope="module")
def written(curved, tmp_path_factory):
    return write_all(curved, tmp_path_factory.mktemp("fabrication"))


@pytest.mark.slow
def test_every_file_is_written_and_the_same_bytes_again_but_for_step(curved, written, tmp_path):
    """OCCT counts in its text: its files hold equal solids, not equal bytes."""
    first, _ = written
    again, _ = write_all(curved, tmp_path)
    assert [path.name for path in first] == [path.name for path in again] == [*FILES, *SHEETS]
    for path, other in zip(first, again, strict=True):
        assert path.suffix == ".step" or path.read_bytes() == other.read_bytes()


@pytest.mark.slow
def test_coupon_cover_and_3mf_pass_their_own_check(curved, written):
    paths, made = written
    findings = [
        *cover_verdicts(curved, made.cover, TITLE.process),
        *mount_verdicts(curved, made.mount, TITLE.process),
    ]
    for name in ("housing.3mf", "coupon.stl", "coupon.step", "cover.stl", "cover.step"):
        findings += check_file(paths[0].with_name(name))
    assert [finding.name for finding in findings if finding.passed is not True] == []


def variant(sensor, **changes):
    """Return the sensor with a housing of other dimensions; a high leaf by its length."""
    housing = sensor.housing
    if "high" in changes:
        changes["high"] = replace(housing.high, length=changes["high"])
    return replace(sensor, housing=replace(housing, **changes))


PROCESS = {
    "fdm-petg": (
        (
            "Nozzle 0.4 mm", "No brim on leaves", "L leaves are 2 lines, H leaves 3", "assumes solid leaves",
            "Calibrate each unit", "E = C F / d", "Do not round or sand the tip faces", "pattern of the infill",
        ),
        ("isopropanol", "argon", "H900", "powder out", "Two plates", "dowel"),
    ),
    "sla-resin": (
        ("Wash 10 min in isopropanol", "30 min at 60 C"), ("Nozzle", "No support", "argon", "brim", "A slicer counts"),
    ),
    "sls-pa12": (("powder out of every gap", "2 bar"), ("Nozzle", "isopropanol", "argon", "brim")),
    "dmls-17-4ph": (("H900, 480 C for 1 h", "by wire AFTER the heat"), ("argon", "No support", "brim")),
    "dmls-ti64": (("650 to 750", "argon"), ("H900", "No support", "brim")),
}  # fmt: skip
MOUNTED = {
    "covers": (
        ("12 mm to grip\n(plate 6 + two covers of 3)", "M3 x 25", "to 0.5 N m", "on shorter screws, M3 x 16."),
        ("wide (ISO 7089)",),
    ),
    "washers": (("M3, 7 mm wide (ISO 7089)", "6 mm between them", "on shorter screws, M3 x 10."), ("to grip\n",)),
}
SQUARE = (
    (
        "Make housing.stl twice", "Ream the holes of 2.95 mm in the bar to 3 H7", "3 m6 x 10 mm (ISO 8734)", "M3 x 25",
        "17.6 mm to grip (two plates 11.6 + two covers of 3)", "domes of radius 10 mm",
        "## Check the tips",
    ),
    ("Zero the tips", "Do not round or sand the tip faces", "The front one hides the marks"),
)  # fmt: skip


def assert_tells(text, told):
    """Assert what a sheet tells and what it does not, and that every heading has one empty line before it."""
    words, absent = told
    assert [part for part in words if part not in text] == []
    assert [part for part in absent if part in text] == []
    lines = text.splitlines()
    headings = [number for number, line in enumerate(lines) if line.startswith("## ")]
    assert all(lines[number - 1] == "" != lines[number - 2] for number in headings)


@pytest.mark.parametrize("name", PROCESS)
def test_sheet_is_true_to_its_process(name, sensor):
    assert_tells(sheet_of(sensor, replace(TITLE, process=PROCESSES[name])), PROCESS[name])


@pytest.mark.parametrize("mount", MOUNTED)
def test_sheet_tells_the_mount_that_was_solved(mount, sensor):
    assert_tells(sheet_of(variant(sensor, mount=mount)), MOUNTED[mount])


@pytest.mark.parametrize(
    ("bench", "digits"),
    [(None, ["0.001", "0.1", "0.0001", "1"]), (Bench(dial_mm=0.02, balance_g=0.5), ["0.02", "0.5", "0.02", "0.5"])],
    ids=["what K to 1 % needs", "that of the design"],
)
def test_sheet_has_the_last_digits_of_the_bench(bench, digits, sensor):
    """Rows of the low and the high spring, which end with those of dial and balance."""
    lines = sheet_of(sensor, bench=bench).partition("| balance to g |")[2].splitlines()[2:4]
    assert [cell for line in lines for cell in line.strip(" |").split(" | ")[-2:]] == digits


def test_process_without_a_known_cycle_or_printer_is_told_no_other_ones(sensor):
    alloy = replace(PROCESSES["dmls-ti64"], name="dmls-316l", material="316L")
    milled = replace(PROCESSES["sla-resin"], name="milled", kind="other")
    told = (("by the cycle that the maker of the powder gives",), ("argon",))
    assert_tells(sheet_of(sensor, replace(TITLE, process=alloy)), told)
    assert_tells(sheet_of(sensor, replace(TITLE, process=milled)), (("## Make",), ("Nozzle",)))


def test_sheet_of_a_square_says_how_two_plates_are_put_together_and_checked():
    square = square_sensor()
    words, absent = SQUARE
    title = Title(name="gentle-square", process=RESIN)
    tenth = f"a tenth of the travel, {0.1 * square.press.travel_mm:.2g} mm"
    assert_tells(sheet_of(square, title), ((*words, tenth), absent))
    told = (("11.6 mm between their washers",), ("cover.stl",))
    assert_tells(sheet_of(variant(square, mount="washers"), title), told)


SKIN = {"skin_mm": 0.2, "skin_E_MPa": 20.0}


@pytest.mark.parametrize(("fruit", "told"), [({}, True), (SKIN, False)])
def test_sheet_names_a_ball_where_a_unit_takes_one(fruit, told):
    """The form of the domes may be off by what their process makes of an outline, whatever the sensor is."""
    square = square_sensor()
    sensor = with_seats(replace(square, fruit=replace(square.fruit, **fruit)), RESIN)
    signal = signal_path(Readout(), springs_of(sensor), RESIN, sensor.tips.springs)
    text = sheet_of(sensor, Title(name="gentle-square", process=RESIN), signal)
    assert ("--ball" in text) == told
    good, within = re.findall(r"(?:lies|outlines)\s+within ([\d.]+) mm", text)
    assert float(good) == float(within) == RESIN.accuracy_mm
    assert not re.search(r"reads E \d", text)


@pytest.mark.parametrize("is_square", [False, True])
def test_magnets_of_a_hall_sensor_fit_their_pockets_where_the_sheet_says(is_square, sensor):
    """Both discs of the sheet, 2 x 1 mm, are flush in their pockets; the sensor faces them half the travel higher."""
    process = RESIN if is_square else TITLE.process
    plain = square_sensor() if is_square else sensor
    seated = with_seats(plain, process)
    signal = signal_path(Readout(), springs_of(seated), process, seated.tips.springs)
    text = sheet_of(seated, Title(name="hall", process=process), signal)
    found = re.search(r"middles are ([\d.]+) and ([\d.]+) mm below .+, ([\d.]+) mm to either side", text)
    assert found is not None
    *below, aside = (float(number) for number in found.groups())
    housing = seated.housing
    for x, depth in itertools.product((-aside, aside), below):
        middle = cq.Vector(x, -0.5 * housing.depth, housing.top_level - depth)
        disc = cq.Solid.makeCylinder(1.0, 1.0, middle, cq.Vector(0.0, 1.0, 0.0))
        assert plain.part.shape.intersect(disc).Volume() == pytest.approx(math.pi, rel=1e-6)
        assert seated.part.shape.intersect(disc).Volume() == 0.0
    found = re.search(r"Its middle is ([\d.]+) mm below the upper edge of the frame", text)
    assert found is not None
    assert 0.5 * sum(below) - float(found[1]) == pytest.approx(0.5 * seated.press.travel_mm, abs=0.011)


@pytest.mark.parametrize("folder", ["outputs/hx", "my designs/hx 2"])
def test_commands_of_the_sheet_name_the_folder_that_was_written(folder, sensor):
    seated = with_seats(sensor, TITLE.process)
    signal = signal_path(Readout(), springs_of(seated), TITLE.process, seated.tips.springs)
    text = sheet_of(seated, signal=signal, folder=folder)
    commands = [shlex.split(line) for line in text.splitlines() if line.lstrip().startswith("pipeline ")]
    assert {words[1] for words in commands} == {"calibrate", "read"}
    assert {words[2] for words in commands} == {folder}


@pytest.mark.parametrize(
    ("mount", "is_square", "told", "absent"),
    [
        ("covers", False, ("window of its cover", "windows of the front cover"), (" arm ", "The bracket has")),
        ("covers", True, ("window of its cover", "The bracket has a window"), (" arm ", "the front cover")),
        ("washers", False, ("stands on an arm", "cut a window"), ("of its cover", "The bracket has")),
    ],
)
def test_sheet_says_where_a_hall_sensor_lies(mount, is_square, told, absent, sensor):
    seated = with_seats(square_sensor() if is_square else sensor, TITLE.process)
    seated = variant(seated, mount=mount)
    signal = signal_path(Readout(), springs_of(seated), TITLE.process, seated.tips.springs)
    _, _, text = sheet_of(seated, signal=signal).partition("## Hall sensors")
    text = text.partition("## ")[0]
    assert [words for words in told if words not in text] == []
    assert [words for words in absent if words in text] == []


def test_sheet_of_a_part_has_its_numbers(sensor):
    volume = 1e-3 * sensor.part.shape.Volume()
    factor = f"{modulus_factor(sensor.housing.low):.5g}"
    assert_tells(sheet_of(sensor), ((f"{volume:.2f} cm3, {1.27 * volume:.1f} g", factor), ()))
    found = re.search(r"A slicer counts ([\d.]+) to ([\d.]+) g", sheet_of(sensor))
    assert found is not None
    assert [float(grams) for grams in found.groups()] == pytest.approx(
        [0.99 * 1.27 * volume, 1.04 * 1.27 * volume], abs=0.05
    )


PRINTED = {
    "layer": 0.2, "line width": 0.4, "filled": True, "rectilinear": True, "perimeters": 2, "foot": 0.15,
    "support or brim": False,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
def test_slicer_prints_a_plate_by_its_settings_and_an_stl_by_the_profile(written, tmp_path):
    """The profile has other settings: they are read back from the lines of the housing without settings."""
    paths, _ = written
    plate, bare = (paths[0].with_name(name) for name in ("plate.3mf", "housing.stl"))
    profile = ("--brim-width", "3", "--bed-shape", "0x0,180x0,180x180,0x180")
    lines = sliced(plate, tmp_path, "--dont-arrange", "--gcode-label-objects", *profile)
    assert lines.settings(read_3mf(plate).mesh.volume) == PRINTED
    assert set(lines.objects) == {"housing", "cover 1", "cover 2", "coupon", "mount"}
    other = sliced(bare, tmp_path, *profile).settings(read_stl(bare).volume)
    assert [name for name, setting in PRINTED.items() if other[name] == setting] == []


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="prusa-slicer is not installed")
def test_slicer_counts_a_mass_within_the_range_of_the_sheet(written, tmp_path):
    """At 100 % infill, which needs another pattern than the slicer's own; without a skirt."""
    paths, _ = written
    for name in ("housing", "coupon"):
        part = paths[0].with_name(f"{name}.stl")
        settings = ["--fill-density", "100%", "--layer-height", "0.2", "--skirts", "0", "--nozzle-diameter", "0.4"]
        command = ["prusa-slicer", "--export-gcode", *settings, "--output", str(tmp_path / "part.gcode"), str(part)]
        refused = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=False)
        assert "fill pattern" in refused.stderr + refused.stdout
        subprocess.run([*command, "--fill-pattern", "rectilinear"], capture_output=True, timeout=DEADLINE_S, check=True)
        length = re.search(r"filament used \[mm\] = ([\d.]+)", (tmp_path / "part.gcode").read_text())
        assert length is not None
        laid = float(length[1]) * 0.25 * math.pi * FILAMENT_MM**2
        assert 0.99 < laid / read_stl(part).volume < 1.04

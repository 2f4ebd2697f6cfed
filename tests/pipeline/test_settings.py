"""A setting takes effect or is refused: random settings on random designs, by each of the ways to give them.

What is compared is the design with which the solve of contact or the sizing of springs begins.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import twintip
from pipeline import sensor
from pipeline.options import load_design, preset_names
from pipeline.study.points import points_of
from pipeline.study.tasks import solve_points
from sensor.design.design_file import TABLE_TYPES, design_as_mapping, design_as_toml, every_key, tables_as_toml
from sensor.design.parameters import TABLES, Design
from sensor.design.processes import PROCESSES, process_as_table
from sensor.input_file import read_toml
from sensor.quantity import InputError
from twintip.cli import main

SEED = 27
FEWEST = 0.2  # of the designs by each way must be solved, and must be refused
OWN = {"petg-750": 750.0, "petg-900": 900.0, "petg-1300": 1300.0}
"""Processes of a file: their names and moduli [MPa]."""
OTHER = {"other-650": 650.0}

BALL = {"shape": "sphere", "radius_mm": 30.0, "height_mm": 12.0}
PIECE = {"length_mm": 20.0, "width_mm": 20.0}
DOMES = {"shape": "dome", "dome_radius_mm": 8.0, "side_mm": 5.0, "spacing_mm": 8.0}
SPRINGS = {"K_l_N_per_m": 120.0, "K_h_N_per_m": 1300.0}
READOUT = {"bits": 24.0}
BASES: tuple[dict[str, Any], ...] = (
    {},
    {"springs": SPRINGS},
    {"targets": {"P_max": 4.0, "NL": 0.06}, "press": {"tilt_deg": 1.0}},
    {"fruit": {**BALL, **PIECE}, "tips": DOMES, "reading": {"tilt_deg": 2.0}},
    {"fruit": {**BALL, "shape": "ellipsoid", "radius_across_mm": 40.0, "thickness_mm": 10.0}, "tips": DOMES},
    {"fruit": {"skin_mm": 0.3, "skin_E_MPa": 9.0}},
    {"fruit": {"relaxation": [[0.3, 2.0]]}, "press": {"speed_mm_per_s": 1.0, "hold_s": 2.0}},
    {"springs": SPRINGS, "tips": {"layout": "line", "order": "LHL", "spacing_mm": 5.0}},
    {"readout": {**READOUT, "delay_ms": [0.0, 1.0]}, "print": {"process": "fdm-pla"}},
    {"springs": SPRINGS, "tips": {"layout": "square"}, "readout": {**READOUT, "delay_ms": [0.0, 1.0, 2.0, 3.0]}},
    {"print": {"process": "petg-1300", "process_file": "own.toml"}, "fruit": BALL, "tips": DOMES},
    {"print": {"process_file": "other.toml", "E_MPa": 700.0}},
)
TOGETHER: tuple[tuple[str, ...], ...] = (
    ("springs.K_l_N_per_m", "springs.K_h_N_per_m"),
    ("fruit.skin_mm", "fruit.skin_E_MPa", "fruit.skin_poisson"),
    ("fruit.relaxation", "press.speed_mm_per_s", "press.hold_s"),
    ("fruit.shape", "fruit.radius_mm"),
    ("fruit.radius_mm", "fruit.thickness_mm"),
    ("print.process",),
    ("print.process", "print.process_file"),
    ("print.process", "printer.E_MPa"),
    ("printer.E_MPa",),
    ("reading", "reading.tilt_deg"),
    ("print", "print.process"),
)
VALUES: dict[str, tuple[object, ...]] = {
    "name": ("mine", "a/b"),
    "fruit.relaxation": ([[0.2, 1.5]],),
    "fruit.skin_mm": (0.2,),
    "fruit.skin_E_MPa": (12.0,),
    "fruit.skin_poisson": (0.4,),
    "fruit.radius_mm": (27.0, 33.0),
    "fruit.radius_across_mm": (35.0,),
    "fruit.azimuth_deg": (30.0,),
    "fruit.thickness_mm": (9.0, 11.0),
    "fruit.length_mm": (19.0, 22.0),
    "fruit.width_mm": (19.0, 22.0),
    "fruit.bruise_limit_MPa": (0.3,),
    "press.speed_mm_per_s": (2.0,),
    "press.hold_s": (1.0,),
    "tips.outer_mm": (0.1,),
    "print.process": (*OWN, *OWN, *OWN, *PROCESSES, "nonsense"),
    "print.process_file": ("own.toml", "other.toml"),
    "printer.E_MPa": (820.0,),
    "reading.radius_mm": ([28.0, 32.0],),
    "reading.radius_across_mm": ([28.0, 32.0],),
    "reading.thickness_mm": ([9.0, 12.0],),
    "readout.delay_ms": ([0.0, 2.0], [0.0, 1.0, 2.0, 3.0]),
    "springs.K_l_N_per_m": (110.0,),
    "springs.K_h_N_per_m": (1400.0,),
}
ONLY_SET = {"name", "fruit.relaxation", "print.process_file", "printer.E_MPa"}
"""Settings that a study takes under [set] alone, beside all that unset."""


class Began(Exception):  # noqa: N818 - no error: a solve began
    """Carries the design out of an evaluation whose first solve begins."""

    def __init__(self, design):
        """Take the design."""
        super().__init__()
        self.design = design


@dataclass
class Case:
    """A design file and settings on it."""

    file: Path
    settings: dict[str, object]

    @property
    def given(self) -> dict[str, Any]:
        """Return the tables of the file."""
        return read_toml(self.file, "")


@pytest.fixture
def began(monkeypatch):
    """Let each evaluation end where its first solve begins; return the designs that the studies began with."""
    designs = []

    def begin(design, *_):
        raise Began(design)

    def begin_point(design, *_):
        designs.append(design)
        raise Began(design)

    monkeypatch.setattr(sensor, "refuse_unsolvable", lambda _: None)
    monkeypatch.setattr(sensor, "fruit_compliance", begin)
    monkeypatch.setattr(sensor, "scene_compliance", lambda *_: None)
    monkeypatch.setattr(sensor, "spring_sizing", begin_point)
    return designs


def process_file(moduli: Mapping[str, float]) -> str:
    """Return a file of processes that differ from PETG by their moduli [MPa]."""
    tables = {"name": "none"}
    for name, E in moduli.items():
        tables[name] = {**process_as_table(PROCESSES["fdm-petg"]), "E_MPa": E}
    return tables_as_toml(tables).partition("\n")[2]


def cases(folder: Path, draws: int):
    """Yield a preset or another design, as a file of its own or as a run writes it, with settings drawn at random."""
    rng = np.random.default_rng(SEED)
    (folder / "own.toml").write_text(process_file(OWN), encoding="utf-8")
    (folder / "other.toml").write_text(process_file(OTHER), encoding="utf-8")
    files = []
    for name in preset_names():
        files.append(folder / f"{name}.toml")
        files[-1].write_text(design_as_toml(load_design(name)), encoding="utf-8")
    for number, base in enumerate(BASES):
        files.append(folder / f"base-{number}.toml")
        files[-1].write_text(tables_as_toml({"name": f"base-{number}", **base}), encoding="utf-8")
    for _ in range(draws):
        file = files[rng.integers(len(files))]
        yield Case(file, drawn(rng, load_design(file), folder))


def drawn(rng: np.random.Generator, base: Design, folder: Path) -> dict[str, object]:
    """Return settings at random: keys that belong together, and one to three others."""
    used = []
    for table, values in design_as_mapping(base).items():
        used += [f"{table}.{key}" for key in values] if table in TABLE_TYPES else []
    names = list(TOGETHER[rng.integers(len(TOGETHER))]) if rng.random() < 0.5 else []
    names += rng.choice(used, rng.integers(1, 3), replace=False).tolist()
    names += rng.choice(every_key(), rng.integers(0, 2)).tolist()
    names += ["print.process"] if base.printer is not None and rng.random() < 0.7 else []
    if rng.random() < 0.1:
        names += rng.choice(["name", "reading", "readout", "targets", "springs", "printer"], 1).tolist()
    settings: dict[str, object] = {}
    for name in rng.permutation(list(dict.fromkeys(names))).tolist():
        settings[name] = value_for(rng, base, name)
        if name == "print.process_file" and settings[name] is not None:
            settings[name] = str(folder / str(settings[name]))
    if all(value is None or name in {*ONLY_SET, "print.process"} for name, value in settings.items()):
        settings["press.travel_mm"] = 0.55  # a study varies one key at least
    return settings


def value_for(rng: np.random.Generator, base: Design, name: str) -> object:
    """Return a value of a key, None to unset it."""
    table, _, key = name.partition(".")
    if name in TABLES or (rng.random() < 0.1 and table in TABLE_TYPES):
        return None
    if name in VALUES:
        return VALUES[name][rng.integers(len(VALUES[name]))]
    item = TABLE_TYPES[table].__dataclass_fields__[key]
    if "options" in item.metadata:
        return str(rng.choice(item.metadata["options"]))
    held = getattr(getattr(base, table), key, item.default)
    factor = float(rng.choice([0.9, 1.1]))
    if isinstance(held, tuple):
        return [factor * each for each in held]
    return factor * held if held else float(rng.choice([0.1, 1.0]))


def refused(message: str) -> None:
    """Check that a refusal is one line."""
    assert len(message.splitlines()) == 1


def began_with(evaluation) -> Design | None:
    """Return the design with which an evaluation begins; None where it is refused in one line."""
    try:
        evaluation()
    except Began as begun:
        return begun.design
    except InputError as error:
        return refused(str(error))
    message = "an evaluation ended before its first solve"
    raise AssertionError(message)


def by_load_design(case: Case) -> Design | None:
    return began_with(lambda: twintip.evaluate(twintip.load_design(case.file, case.settings)))


def by_flags(case: Case, capsys) -> Design | None:
    flags = []
    for name, value in case.settings.items():
        text = "" if value is None else value if isinstance(value, str) else json.dumps(value)
        flags += ["--set", f"{name}={text}"]
    try:
        code = main(["run", str(case.file), "--look", "--out", str(case.file.parent / "look"), *flags])
    except Began as begun:
        return begun.design
    assert code == 2
    return refused(capsys.readouterr().err.strip())


def by_study(case: Case, began: list[Design]) -> Design | None:
    """Set what a study can only set, and vary the rest over one value each."""
    under = {"set": {}, "vary": {}}
    for name, value in case.settings.items():
        set_only = (
            value is None or name in ONLY_SET or (name == "print.process" and "print.process_file" in case.settings)
        )
        under["set" if set_only else "vary"][name] = "" if value is None else value if set_only else [value]
    lines = [f'base = "{case.file.name}"', 'how = "grid"', 'wanted = ["springs.K_l_N_per_m"]']
    for table, values in under.items():
        lines += [f"[{table}]", *(f"{json.dumps(name)} = {json.dumps(value)}" for name, value in values.items())]
    file = case.file.parent / "a-study.toml"
    file.write_text("\n".join(lines), encoding="utf-8")
    began.clear()
    try:
        study = twintip.read_study(file)
    except InputError as error:
        return refused(str(error))
    (result,) = solve_points(study, file.parent, tuple(points_of(study)))
    assert dict(result.settings).keys() == under["vary"].keys()
    if not began:
        assert result.status == "refused", result.error
        return refused(result.error)
    return began[0]


def assert_has(design: Design, case: Case) -> None:
    """Check that each key of a design was set, or is as in the design without settings."""
    base = load_design(case.file)
    given = case.given
    settings = case.settings
    free = {"print.process", "print.process_file"}  # see `assert_process`
    if any(name.startswith("fruit.") for name in settings):  # the plan of a whole fruit follows from other keys
        free |= {f"fruit.{key}" for key in ("length_mm", "width_mm") if key not in given.get("fruit", {})}
        free |= {name for name in ("fruit.length_mm", "fruit.width_mm") if name in settings}
    for name in every_key():
        table, _, key = name.partition(".")
        default = TABLE_TYPES[table].__dataclass_fields__[key].default
        value = getattr(getattr(design, table), key, None)
        if settings.get(name) is not None and name != "print.process_file":
            assert value == as_record(settings[name]), name
        elif name not in free and table not in settings and getattr(design, table) is not None:
            assert value == (default if name in settings else getattr(getattr(base, table), key, default)), name
    for table in ("reading", "readout"):
        asked = any(name.startswith(f"{table}.") and value is not None for name, value in settings.items())
        assert (getattr(design, table) is not None) == (asked or (table in given and table not in settings)), table
    assert design.name == settings.get("name", base.name)
    assert_process(design, case)


def assert_process(design: Design, case: Case) -> None:
    """Check that a design has the numbers of the process that it names."""
    known = design.print.process in PROCESSES
    assert (design.printer is None) == known
    E = PROCESSES[design.print.process].E_MPa if known else (OWN | OTHER)[design.print.process]
    assert design.process.E_MPa in (design.print.E_MPa, case.settings.get("printer.E_MPa", E))


def as_record(value: object) -> object:
    """Return a value as a record holds it."""
    return tuple(map(as_record, value)) if isinstance(value, list) else value


@pytest.mark.parametrize("draws", [100, pytest.param(300, marks=pytest.mark.slow)])
def test_settings_take_effect_or_are_refused(tmp_path, began, capsys, draws):
    """Flags, a study and load_design agree; so does the design.toml of a run, where it holds what is asked for."""
    solved = {"flags": 0, "study": 0, "load_design": 0, "design.toml": 0}
    for case in cases(tmp_path, draws):
        own = tmp_path / "design.toml"
        own.write_text(f"# pipeline run\n{design_as_toml(load_design(case.file))}", encoding="utf-8")
        of_run = Case(own, case.settings)
        designs = {
            "flags": by_flags(case, capsys),
            "study": by_study(case, began),
            "load_design": by_load_design(case),
        }
        assert designs["flags"] == designs["study"] == designs["load_design"], case
        designs["design.toml"] = by_load_design(of_run)
        for way, design in designs.items():
            if design is not None:
                solved[way] += 1
                assert_has(design, of_run if way == "design.toml" else case)
    assert all(FEWEST * draws <= count <= (1.0 - FEWEST) * draws for count in solved.values()), solved

"""A process of one's own: a file beside the design, the checks of the known ones, and a design that stands alone."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.options import design_tables, load_design
from sensor.design.design_file import design_as_mapping, design_as_toml, design_from_mapping
from sensor.design.parameters import Design, Print
from sensor.design.processes import PROCESSES, process_as_table
from sensor.quantity import InputError

DATA = Path(__file__).parents[3] / "sensor" / "design" / "processes.toml"
RESIN = DATA.read_text(encoding="utf-8").partition("[sla-resin]")[2].partition("[dmls-17-4ph]")[0]
OWN = "[tough-resin]" + RESIN.replace("sla-resin", "tough-resin").replace("E_MPa = 2500.0", "E_MPa = 1900.0")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder that is not the current one, with a design file and a process file beside it."""
    (tmp_path / "designs").mkdir()
    (tmp_path / "designs" / "mine.toml").write_text('[print]\nprocess_file = "printers/own.toml"\n', encoding="utf-8")
    (tmp_path / "designs" / "printers").mkdir()
    (tmp_path / "designs" / "printers" / "own.toml").write_text(OWN, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "designs"


def refusal(folder, text):
    (folder / "printers" / "own.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_design(folder / "mine.toml")
    assert len(str(caught.value).splitlines()) == 1
    return caught.value


def test_design_has_the_process_of_the_file_beside_it_and_its_output_stands_alone(folder):
    """The design file of the output holds the process itself, names no path and reads back as the same design."""
    design = load_design(folder / "mine.toml")
    assert design.print == Print(process="tough-resin")
    assert design.process == replace(PROCESSES["sla-resin"], name="tough-resin", E_MPa=1900.0)
    text = design_as_toml(design)
    assert "process_file" not in text
    assert design_from_mapping(tomllib.loads(text)) == design
    assert design_as_mapping(design)["printer"] == tomllib.loads(OWN)["tough-resin"]


def test_flag_names_a_file_from_the_current_folder_and_a_known_process_takes_its_place(folder):
    settings = {"print.process_file": "designs/printers/own.toml"}
    assert load_design("paper", settings).process.E_MPa == 1900.0
    assert load_design(folder / "mine.toml", {"print.process": "fdm-pla"}).process is PROCESSES["fdm-pla"]
    (folder / "alone.toml").write_text(design_as_toml(load_design(folder / "mine.toml")), encoding="utf-8")
    assert load_design(folder / "alone.toml", {"print.process": "fdm-pla"}).process is PROCESSES["fdm-pla"]


def test_one_of_several_processes_is_named(folder):
    error = refusal(folder, OWN + OWN.replace("tough-resin", "soft-resin").replace("1900.0", "900.0"))
    assert error.field == "print.process"
    assert "tough-resin, soft-resin" in error.bound
    tables = design_tables(folder / "mine.toml")
    for name, E in (("soft-resin", 900.0), ("tough-resin", 1900.0), ("sla-resin", PROCESSES["sla-resin"].E_MPa)):
        process = tables.design({"print.process": name}).process
        assert (process.name, process.E_MPa) == (name, E)
    assert tables.design({"print.process": "soft-resin", "printer.E_MPa": 950.0}).process.E_MPa == 950.0


@pytest.mark.parametrize(
    "settings",
    [
        {"print.process": "soft-resin"},
        {"print.process": "fdm-pte"},
        {"print.process": [1.0]},
        {"print.process": "fdm-pla", "printer.E_MPa": 950.0},
        {"print.process_file": "designs/printers/own.toml", "print.process": "fdm-pla"},
        {"print.process": "fdm-pla", "print.process_file": "designs/printers/own.toml"},
    ],
)
def test_setting_that_a_run_of_an_own_process_cannot_take_is_refused(folder, settings):
    (folder / "of-run.toml").write_text(design_as_toml(load_design(folder / "mine.toml")), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_design(folder / "of-run.toml", settings)
    assert error.value.field in settings
    assert len(str(error.value).splitlines()) == 1


def test_without_its_own_processes_a_design_has_the_usual_one(folder):
    (folder / "of-run.toml").write_text(design_as_toml(load_design(folder / "mine.toml")), encoding="utf-8")
    for name, key in (("mine", "print.process_file"), ("of-run", "printer"), ("of-run", "print")):
        assert load_design(folder / f"{name}.toml", {key: None}).process is PROCESSES["fdm-petg"]


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("E_MPa = 1900.0", "E_MPA = 1900.0", "process tough-resin.E_MPA"),
        ("E_MPa = 1900.0", "E_MPa = 1900000000.0", "process tough-resin.E_MPa"),
        ("E_MPa = 1900.0", "", "process tough-resin.E_MPa"),
        ('poisson = "typical', '# "typical', "process tough-resin.poisson"),
        ("poisson = 0.38", 'poisson = "0.38"', "process tough-resin.poisson"),
        ('kind = "sla"', 'kind = "resin"', "process tough-resin.kind"),
        ('poisson = "typical', 'density = "typical', "process tough-resin.density"),
        ("tough-resin", "sla-resin", "print.process"),
        ("tough-resin", '"a b"', "print.process"),
        ("[tough-resin]", "[tough-resin", "print.process_file"),
        (OWN, "number = 3", "process number"),
        (OWN, "", "print.process"),
    ],
)
def test_planted_fault_is_refused_in_one_line(old, new, field, folder):
    assert old in OWN
    assert refusal(folder, OWN.replace(old, new)).field == field


def test_file_that_is_missing_or_given_twice_is_refused(folder):
    (folder / "printers" / "own.toml").unlink()
    with pytest.raises(InputError):
        load_design(folder / "mine.toml")
    with pytest.raises(InputError) as error:
        design_from_mapping({"print": {"process_file": "own.toml"}, "printer": {}})
    assert error.value.field == "print.process_file"


def test_design_and_its_own_process_have_one_name():
    own = replace(PROCESSES["sla-resin"], name="tough-resin")
    assert Design(print=Print(process="tough-resin"), printer=own).process is own
    for name in ("sla-resin", "other-resin"):
        with pytest.raises(InputError) as error:
            Design(print=Print(process=name), printer=own)
        assert error.value.field == "print.process"
    assert process_as_table(own)["sources"] == dict(own.sources)

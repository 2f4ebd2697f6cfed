"""A process of one's own: a file beside the design, the checks of the known ones, and a design that stands alone."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from cad.design.design_file import design_as_mapping, design_as_toml, design_from_mapping
from cad.design.parameters import Design, Print
from cad.design.processes import PROCESSES, process_as_table
from cad.quantity import InputError
from pipeline.options import load_design

DATA = Path(__file__).parents[3] / "cad" / "design" / "processes.toml"
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
    (line,) = str(caught.value).splitlines()
    return line


def test_design_has_the_process_of_the_file_beside_it(folder):
    design = load_design(folder / "mine.toml")
    assert design.print == Print(process="tough-resin")
    expected = replace(PROCESSES["sla-resin"], name="tough-resin", E_MPa=1900.0)
    assert design.process == expected


def test_output_stands_alone(folder):
    """The design file of the output holds the process itself, names no path and reads back as the same design."""
    design = load_design(folder / "mine.toml")
    text = design_as_toml(design)
    assert "process_file" not in text
    assert design_from_mapping(tomllib.loads(text)) == design
    held = design_as_mapping(design)["printer"]
    assert held == tomllib.loads(OWN)["tough-resin"]
    assert design_from_mapping(design_as_mapping(design)) == design


def test_flag_names_a_file_from_the_current_folder_and_a_known_process_takes_its_place(folder):
    settings = {"print.process_file": "designs/printers/own.toml"}
    assert load_design("paper", settings).process.E_MPa == 1900.0
    assert load_design(folder / "mine.toml", {"print.process": "fdm-pla"}).process is PROCESSES["fdm-pla"]
    (folder / "alone.toml").write_text(design_as_toml(load_design(folder / "mine.toml")), encoding="utf-8")
    assert load_design(folder / "alone.toml", {"print.process": "fdm-pla"}).process is PROCESSES["fdm-pla"]


def test_flag_unsets_the_file_and_takes_its_path_with_the_quotes_of_toml(folder):
    mine = folder / "mine.toml"
    for empty in ("", None):
        assert load_design(mine, {"print.process_file": empty}) == load_design("paper", {"name": "mine"})
    other = OWN.replace("tough-resin", "soft-resin").replace("1900.0", "900.0")
    (folder / "other.toml").write_text(other, encoding="utf-8")
    for text in ("designs/other.toml", '"designs/other.toml"', "'designs/other.toml'"):
        assert load_design(mine, {"print.process_file": text}).process.E_MPa == 900.0
    assert load_design(mine, {"print.process": '"fdm-pla"'}).process is PROCESSES["fdm-pla"]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"print.process": '["a"]'}, r"print\.process = \['a'\]: must be 1 to 64 letters"),
        ({"print.process": "{a = 1}"}, r"print\.process = \{'a': 1\}: must be 1 to 64 letters"),
        ({"print.process_file": '""'}, r"print\.process_file = '': must be the path of a TOML file"),
        ({"print.process_file": "3"}, r"print\.process_file = 3: must be the path of a TOML file"),
    ],
)
def test_process_or_file_of_another_kind_is_refused_in_one_line(settings, words, folder):
    with pytest.raises(InputError, match=f"^{words}") as caught:
        load_design(folder / "mine.toml", settings)
    assert "\n" not in str(caught.value)
    listed = '[print]\nprocess = ["a"]\nprocess_file = "printers/own.toml"\n'
    (folder / "mine.toml").write_text(listed, encoding="utf-8")
    for other in ({}, {"print.process_file": "designs/printers/own.toml"}):
        with pytest.raises(InputError, match=r"^print\.process = \['a'\]: must be"):
            load_design(folder / "mine.toml", other)


def test_one_of_several_processes_is_named(folder):
    two = OWN + OWN.replace("tough-resin", "soft-resin").replace("1900.0", "900.0")
    line = refusal(folder, two)
    assert line == (
        "print.process = None: must be one of those in 'own.toml': tough-resin, soft-resin; name one with print.process"
    )
    assert load_design(folder / "mine.toml", {"print.process": "soft-resin"}).process.E_MPa == 900.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("E_MPa = 1900.0", "E_MPA = 1900.0", "E_MPA = 1900: must be left out; did you mean E_MPa?"),
        ("E_MPa = 1900.0", "E_MPa = 1900000000.0", "E_MPa = 1.9e+09 MPa: must be at least 1e-06 and at most 1e+06"),
        ("poisson = 0.38", 'poisson = "0.38"', "poisson = '0.38': must be a number greater than -1"),
        ('kind = "sla"', 'kind = "resin"', "kind = 'resin': must be one of fdm, sla, sls, dmls, other"),
        ('poisson = "typical', 'density = "typical', "must be a number with one source"),
        ("tough-resin", "sla-resin", "print.process = 'sla-resin': must be a name that no known process has"),
        ("tough-resin", '"a b"', "print.process = 'a b': must be 1 to 64 letters"),
        ("[tough-resin]", "[tough-resin", "must be valid TOML; mend that line"),
        (OWN, "number = 3", "process number = '3': must be a table of numbers"),
        (OWN, "", "must be one of those in 'own.toml': none"),
    ],
)  # fmt: skip
def test_planted_fault_is_refused_in_one_line(old, new, words, folder):
    assert old in OWN
    assert words in refusal(folder, OWN.replace(old, new))


def test_file_that_is_missing_or_given_twice_is_refused(folder):
    (folder / "printers" / "own.toml").unlink()
    with pytest.raises(InputError, match=r"^print\.process_file = 'own\.toml': not found; must be a TOML file"):
        load_design(folder / "mine.toml")
    tables = {"print": {"process_file": "own.toml"}, "printer": {}}
    with pytest.raises(InputError, match=r"call load_design, or give Design\.printer"):
        design_from_mapping(tables)


def test_design_and_its_own_process_have_one_name():
    own = replace(PROCESSES["sla-resin"], name="tough-resin")
    assert Design(print=Print(process="tough-resin"), printer=own).process is own
    for name in ("sla-resin", "other-resin"):
        with pytest.raises(InputError, match=f"^print.process = '{name}': must be the name of the design's own"):
            Design(print=Print(process=name), printer=own)
    assert process_as_table(own)["sources"] == dict(own.sources)

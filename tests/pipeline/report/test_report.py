"""report.json comes back as what was written; damage of every kind is an error that names the key."""

import copy
import dataclasses
import json

import numpy as np
import pytest
from refusal import refusal
from stand_ins import relaxing_result, result_of

from pipeline.errors.error_records import ScatterBands
from pipeline.options import RunOptions
from pipeline.report.of_result import report_of_result
from pipeline.report.outputs import listed_files, write_outputs
from pipeline.report.report import ListedFile, read_data, read_report, report_data, report_from_data
from pipeline.storage.digests import file_digest
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import PressMotion, Tips

GONE = "(left out)"
KIWI = Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 2.0)), tips=Tips(socket="pin"), press=PressMotion(travel_mm=0.4))


def with_scatter(result):
    """Return a result with bands of prints, one of which has no end."""
    bands = dict.fromkeys(("K_l_N_per_m", "K_h_N_per_m", "P_max", "NL"), (0.9, 1.1))
    scatter = ScatterBands(**bands, modulus_error=(-0.1, None), calibrated_modulus_error=None, surrogate_error=1e-9)
    return dataclasses.replace(result, errors=dataclasses.replace(result.errors, scatter=scatter))


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Return the report of the default design."""
    folder = tmp_path_factory.mktemp("stored")
    write_outputs(result_of(), folder)
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def put(data, path, value):
    """Return a copy of nested data with another value, or none, at a path of keys."""
    changed = copy.deepcopy(data)
    *above, last = path
    holder = changed
    for key in above:
        holder = holder[key]
    if value is GONE:
        del holder[last]
    else:
        holder[last] = value
    return changed


def test_written_report_is_that_of_the_result(tmp_path):
    result = result_of(KIWI)
    write_outputs(result, tmp_path)
    files = listed_files(tmp_path)
    assert [file.path for file in files] == ["design.toml", "response.csv"]
    assert read_data(tmp_path) == json.loads(json.dumps(report_data(report_of_result(result, files))))
    report = read_report(tmp_path)
    np.testing.assert_allclose(report.compliance.S, result.contact.S, rtol=1e-15)
    assert report.compliance.difference_error == pytest.approx(result.contact.difference_error, rel=1e-12)


VARIANTS = {
    "paper": result_of(),
    "pins": result_of(Design(tips=Tips(socket="pin"))),
    "domes": result_of(Design(tips=Tips(shape="dome", dome_radius_mm=8.0, side_mm=4.5))),
    "not made": result_of(options=RunOptions(fabrication=True), made=False),
    "relaxes": relaxing_result(),
    "scatters": with_scatter(result_of(options=RunOptions(fabrication=True))),
}
"""Results whose reports have between them every key that may be left out or null but those of readings."""


@pytest.mark.parametrize("name", VARIANTS)
def test_report_that_is_read_and_written_again_has_the_same_bytes(name, tmp_path):
    result = VARIANTS[name]
    data = report_data(report_of_result(result))
    text = json.dumps(data, indent=1, allow_nan=False)
    (tmp_path / "report.json").write_text(text, encoding="utf-8")
    assert json.dumps(report_data(read_report(tmp_path)), indent=1, allow_nan=False) == text


DAMAGED = [
    (("housing",), [1], "housing"),
    (("design", "tips", "side_mm"), -1, "tips.side_mm"),
    (("housing", "tip_side"), -3.0, "housing.tip_side"),
    (("housing", "pin_round"), "no", "housing.pin_round"),
    (("deflections_mm",), [0.5], "deflections_mm"),
    (("deflections_mm", 1), None, "deflections_mm[1]"),
    (("response", 2, "E_MPa"), "x", "response[2].E_MPa"),
    (("response", 0, "F_l_N", 1), True, "response[0].F_l_N[1]"),
    (("read_out", "hertz"), "x", "read_out.hertz"),
    (("files", 0), "design.toml", "files[0]"),
]


@pytest.mark.parametrize(("path", "value", "key"), DAMAGED, ids=str)
def test_damaged_report_names_the_key(path, value, key, report, tmp_path):
    caught = refusal(report_from_data, tmp_path, put(report, path, value))
    assert caught.field == "PATH"
    assert key in caught.bound


@pytest.mark.parametrize("text", ["[]", '{"schema": 2}', '{"schema": 1, "deflections_mm": [NaN]}'])
def test_text_that_is_no_report_is_refused(text, tmp_path):
    (tmp_path / "report.json").write_text(text, encoding="utf-8")
    caught = refusal(read_report, tmp_path)
    assert caught.value == str(tmp_path)


@pytest.mark.parametrize("name", ["FileNotFoundError", "IsADirectoryError", "UnicodeDecodeError"])
def test_report_that_cannot_be_read_is_refused_with_its_reason(name, tmp_path):
    if name == "IsADirectoryError":
        (tmp_path / "report.json").mkdir()
    elif name == "UnicodeDecodeError":
        (tmp_path / "report.json").write_bytes(b"\xff\xfe{")
    caught = refusal(read_report, tmp_path)
    assert name in caught.bound


def every_table(data, path=()):
    """Yield the path of every table of nested data that is a record: not the design, nor one whose keys are names."""
    if isinstance(data, dict):
        if path not in [("design",), ("versions",), ("seconds",), ("cpu_seconds",), ("flexures",), ("errors",)]:
            yield path
        for key, inside in data.items():
            if key != "design":
                yield from every_table(inside, (*path, key))
    elif isinstance(data, list):
        for place, inside in enumerate(data[:1]):
            yield from every_table(inside, (*path, place))


def test_unknown_or_missing_key_of_any_table_is_refused_in_one_line(report, tmp_path):
    paths = [path for path in every_table(report) if not set(path) & {"versions", "seconds", "cpu_seconds"}]
    assert len(paths) > 20
    may_be_missing = {"digest", "rise_level", "beam_law_leaves_mm"}
    for path in paths:
        table = report
        for key in path:
            table = table[key]
        damaged = [(put(report, (*path, "unheard_of"), 1.0), "unheard_of")]
        damaged += [(put(report, (*path, key), GONE), key) for key in table if key not in may_be_missing]
        for data, key in damaged:
            caught = refusal(report_from_data, tmp_path, data)
            assert key in caught.bound, path


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("design", "press", "strain"), "linear"),
        (("read_out", "large_strain"), []),
        (("reading",), {"lift_deg": 3.0}),
    ],
)
def test_report_of_0_1_is_refused_in_one_line(path, value, report, tmp_path):
    assert refusal(report_from_data, tmp_path, put(report, path, value)).field == "PATH"


def test_report_of_0_2_is_read_without_the_keys_that_are_gone_or_asked_for_nothing(report, tmp_path):
    mode = {"frequency_Hz": 80.0, "error_percent": 1.0, "shape": "low, along the press"}
    before = report
    for path, value in (
        (("behaviour", "modes"), [mode]),
        (("stale",), {"sheet.md": "0"}),
        (("design", "print", "leaves"), "printed"),
        (("design", "print", "gauges"), "none"),
        (("housing", "gauges"), "none"),
        (("behaviour", "gauge_factor"), 2.1),
        (("behaviour", "low", "bridge_mV_per_V"), [1.0, None]),
    ):
        before = put(before, path, value)
    assert report_from_data(tmp_path, before) == report_from_data(tmp_path, report)
    caught = refusal(report_from_data, tmp_path, put(report, ("design", "print", "leaves"), "spring-steel"))
    assert caught.field == "PATH"
    assert "print.leaves" in caught.bound


@pytest.mark.parametrize("path", ["../secret", "missing", ".", "a\x00b", "x" * 5000])
def test_file_outside_or_missing_or_impossible_is_not_unchanged(path, tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("x", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    stored = ListedFile(path=path, sha256=file_digest(secret))
    assert not stored.is_unchanged_in(tmp_path / "folder")
    inside = dataclasses.replace(stored, path="secret")
    assert inside.is_unchanged_in(tmp_path)
    secret.write_text("y", encoding="utf-8")
    assert not inside.is_unchanged_in(tmp_path)

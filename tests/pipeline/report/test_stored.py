"""report.json comes back as what was written; damage of every kind is one line that names the key."""

import copy
import dataclasses
import json
import re

import pytest
from stand_ins import result_of

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from pipeline.report.outputs import write_outputs
from pipeline.report.stored import StoredFile, StoredResponse, read_report
from pipeline.storage.seal import file_digest

GONE = "(left out)"


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Return the report of the default design."""
    folder = tmp_path_factory.mktemp("stored")
    write_outputs(result_of(), folder)
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def put(data, place, value):
    """Return a copy of nested data with another value, or none, at a place."""
    changed = copy.deepcopy(data)
    *above, last = place
    holder = changed
    for key in above:
        holder = holder[key]
    if value is GONE:
        del holder[last]
    else:
        holder[last] = value
    return changed


def read(data, folder):
    (folder / "report.json").write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return read_report(folder)


@pytest.mark.parametrize(
    "design",
    [Design(), Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 2.0)), tips=Tips(socket="pin"), press=Press(travel_mm=0.4))],
    ids=["paper", "kiwi"],
)
def test_result_comes_back_as_it_was_written(design, tmp_path):
    result = result_of(design)
    write_outputs(result, tmp_path)
    stored = read_report(tmp_path)
    assert stored.design == design
    assert stored.housing == result.springs.housing
    assert stored.deflections_mm == result.springs.deflections
    assert stored.read_out.springs_mm_per_N == tuple(map(tuple, result.springs.C.tolist()))
    assert stored.read_out.own_less_other_per_mm == result.read_out.read_out.own_less_other
    assert stored.moduli == ()
    assert [row.E_MPa for row in stored.response] == list(design.fruit.E_MPa)
    assert [row.x_mm for row in stored.response] == [tuple(result.press.table.x)] * len(stored.response)
    assert [row.last_P for row in stored.response] == result.press.table.P[:, -1].tolist()
    names = {"design.toml", "response.csv"}
    assert {file.path: file.sha256 for file in stored.files} == {name: file_digest(tmp_path / name) for name in names}
    assert all(file.is_unchanged_in(tmp_path) for file in stored.files)


def test_springs_that_were_not_made_have_no_housing(tmp_path):
    write_outputs(result_of(made=False), tmp_path)
    assert read_report(tmp_path).housing is None


def test_run_comes_back_as_it_was_written(default_run):
    stored, result = read_report(default_run.folder), default_run.result
    assert (stored.design, stored.housing) == (result.design, result.springs.housing)
    assert stored.deflections_mm == result.springs.deflections
    written = {path.name for path in default_run.folder.iterdir()} - {"report.json"}
    assert {file.path for file in stored.files} == written
    assert all(file.is_unchanged_in(default_run.folder) for file in stored.files)


KEYS = ("design", "housing", "deflections_mm", "response", "files", "read_out")
DAMAGED = [
    *(((key,), GONE, f"{key} is missing") for key in KEYS),
    *(((key,), 3, f"expected a JSON .* @ {key}") for key in KEYS),
    *(((key,), "text", f"expected a JSON .* @ {key}") for key in KEYS),
    (("design",), [1], "expected a JSON object.* @ design"),
    (("design", "tips"), 3, "tips = 3: must be a table"),
    (("design", "tips", "side_mm"), "1", r"tips\.side_mm = '1' mm: must be a number"),
    (("design", "tips", "side_mm"), -1, r"tips\.side_mm = -1 mm: must be at least 1e-06"),
    (("design", "tip"), {}, "tip: unknown table"),
    (("housing",), [1], "expected a JSON object.* @ housing"),
    (("housing", "tip_side"), GONE, r"required field missing @ housing\.tip_side"),
    (("housing", "tip_side"), -3.0, r"housing\.tip_side = -3 mm: must be greater than 0 mm"),
    (("housing", "tip_side"), "a", r"@ housing\.tip_side"),
    (("housing", "colour"), 1, r"extra fields found \(colour\) @ housing"),
    (("housing", "pin_round"), "no", r"expected bool @ housing\.pin_round"),
    (("deflections_mm",), {}, "expected a JSON list.* @ deflections_mm"),
    (("deflections_mm",), [0.5], "deflections_mm has 1 numbers; must be one for each of 2 springs"),
    (("deflections_mm", 1), None, r"@ deflections_mm\[1\]"),
    (("response", 0), 1, r"expected a JSON object @ response\[0\]"),
    (("response", 2, "E_MPa"), "x", r"@ response\[2\]\.E_MPa"),
    (("response", 0, "x_mm"), 3, r"@ response\[0\]\.x_mm"),
    (("response", 0, "P"), GONE, r"required field missing @ response\[0\]\.P"),
    (("response", 0, "P", 1), True, r"@ response\[0\]\.P\[1\]"),
    (("read_out", "hertz"), "x", r"@ read_out\.hertz"),
    (("read_out", "level"), GONE, r"required field missing @ read_out\.level"),
    (("files", 0), "design.toml", r"expected a JSON object @ files\[0\]"),
    (("files", 0, "path"), GONE, r"required field missing @ files\[0\]\.path"),
    (("files", 1, "sha256"), 3, r"@ files\[1\]\.sha256"),
]


@pytest.mark.parametrize(("place", "value", "message"), DAMAGED, ids=str)
def test_damaged_report_is_one_line_that_names_the_key(place, value, message, report, tmp_path):
    whole = rf"^PATH = '.*': its report\.json must be as it was written \([^\n]*{message}[^\n]*run the design again$"
    with pytest.raises(InputError, match=whole):
        read(put(report, place, value), tmp_path)


@pytest.mark.parametrize("value", [GONE, 2, "1", None])
def test_another_schema_is_refused(value, report, tmp_path):
    with pytest.raises(
        InputError, match=r"its report\.json must be one of pipeline run, schema 1; name an output folder"
    ):
        read(put(report, ("schema",), value), tmp_path)


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '{"schema": 1, "deflections_mm": [NaN]}', "\x00"])
def test_text_that_is_no_report_is_refused(text, tmp_path):
    with pytest.raises(InputError, match=r"^PATH = '[^\n]*': (must hold a report\.json that can be read|its report)"):
        read(text, tmp_path)


@pytest.mark.parametrize("name", ["FileNotFoundError", "IsADirectoryError", "UnicodeDecodeError"])
def test_report_that_cannot_be_read_is_refused_with_its_reason(name, tmp_path):
    if name == "IsADirectoryError":
        (tmp_path / "report.json").mkdir()
    elif name == "UnicodeDecodeError":
        (tmp_path / "report.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(InputError, match=rf"must hold a report\.json that can be read \({name}\)"):
        read_report(tmp_path)


def test_keys_of_later_versions_are_left_alone(report, tmp_path):
    later = put(put(report, ("modulus",), 3), ("response", 0, "E_error"), [1])
    assert read(later, tmp_path) == read(report, tmp_path)


@pytest.mark.parametrize("path", ["../secret", "missing", ".", "a\x00b", "x" * 5000])
def test_file_outside_or_missing_or_impossible_is_not_unchanged(path, tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("x", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    stored = StoredFile(path=path, sha256=file_digest(secret))
    assert not stored.is_unchanged_in(tmp_path / "folder")
    inside = dataclasses.replace(stored, path="secret")
    assert inside.is_unchanged_in(tmp_path)
    secret.write_text("y", encoding="utf-8")
    assert not inside.is_unchanged_in(tmp_path)


@pytest.mark.parametrize(("P", "last"), [((1.0, 2.0, None), 2.0), ((None, None), None), ((), None)])
def test_last_force_ratio_is_that_of_the_deepest_travel_with_all_tips_down(P, last):
    assert StoredResponse(E_MPa=1.0, x_mm=(0.1,) * len(P), P=P).last_P == last


def test_a_key_that_is_not_named_would_be_seen(report, tmp_path):
    """The message of another key does not pass for that of the damaged one."""
    with pytest.raises(InputError) as caught:
        read(put(report, ("files",), 3), tmp_path)
    assert not re.search("@ response", str(caught.value))

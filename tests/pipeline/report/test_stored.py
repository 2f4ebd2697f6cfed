"""report.json comes back as what was written; damage of every kind is an error that names the key."""

import copy
import dataclasses
import json

import numpy as np
import pytest
from stand_ins import result_of

from cad.design.design_file import with_former_defaults
from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Press, Tips
from cad.quantity import InputError
from pipeline.report.mapping import report_mapping
from pipeline.report.outputs import listed_files, write_outputs
from pipeline.report.stored import StoredFile, as_data, read_data, read_report, report_of
from pipeline.storage.digests import file_digest

GONE = "(left out)"
KIWI = Design(name="kiwi", fruit=Fruit(E_MPa=(1.0, 2.0)), tips=Tips(socket="pin"), press=Press(travel_mm=0.4))


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


@pytest.mark.parametrize(("design", "made"), [(Design(), True), (KIWI, False)], ids=["paper", "kiwi"])
def test_report_comes_back_as_it_was_written(design, made, tmp_path):
    """Every number of the file is that of the result, and what is read back is that number again."""
    result = result_of(design, made=made)
    write_outputs(result, tmp_path)
    files = listed_files(tmp_path)
    assert [file.path for file in files] == ["design.toml", "response.csv"]
    data = read_data(tmp_path)
    assert data == report_mapping(result, files)
    report = read_report(tmp_path)
    assert (report.design, report.housing, report.verdicts) == (design, result.springs.housing, result.verdicts)
    for key, value in as_data(report).items():
        if key in data:  # some are left out where they are empty
            assert_part(value, data[key])
    np.testing.assert_allclose(report.compliance.S, result.contact.S, rtol=1e-15)
    assert report.compliance.error_pair == pytest.approx(result.contact.error_pair, rel=1e-12)


def assert_part(value, whole):
    """Assert that nested data read back are, key by key, those of the file; what it leaves out is empty."""
    if isinstance(value, dict):
        for key, inside in value.items():
            if key in whole:
                assert_part(inside, whole[key])
            else:
                assert not inside
    elif isinstance(value, list):
        for inside, of_file in zip(value, whole, strict=True):
            assert_part(inside, of_file)
    else:
        assert value == whole


DAMAGED = [
    *(((key,), GONE, key) for key in ("design", "flexures", "deflections_mm", "files")),
    (("housing",), [1], "housing"),
    (("response",), "text", "response"),
    (("contact",), 3, "contact"),
    (("design", "tips", "side_mm"), -1, "tips.side_mm"),
    (("housing", "tip_side"), -3.0, "housing.tip_side"),
    (("housing", "pin_round"), "no", "housing.pin_round"),
    (("deflections_mm",), {}, "deflections_mm"),
    (("deflections_mm",), [0.5], "deflections_mm"),
    (("deflections_mm", 1), None, "deflections_mm[1]"),
    (("response", 2, "E_MPa"), "x", "response[2].E_MPa"),
    (("response", 0, "F_l_N", 1), True, "response[0].F_l_N[1]"),
    (("read_out", "hertz"), "x", "read_out.hertz"),
    (("files", 0), "design.toml", "files[0]"),
    (("files", 1, "sha256"), 3, "files[1].sha256"),
]


@pytest.mark.parametrize(("path", "value", "key"), DAMAGED, ids=str)
def test_damaged_report_names_the_key(path, value, key, report, tmp_path):
    with pytest.raises(InputError) as caught:
        report_of(tmp_path, put(report, path, value))
    assert caught.value.field == "PATH"
    assert key in caught.value.bound
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["{", "[]", '{"schema": 2}', '{"schema": 1, "deflections_mm": [NaN]}'])
def test_text_that_is_no_report_is_refused(text, tmp_path):
    (tmp_path / "report.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_report(tmp_path)
    assert caught.value.value == str(tmp_path)


@pytest.mark.parametrize("name", ["FileNotFoundError", "IsADirectoryError", "UnicodeDecodeError"])
def test_report_that_cannot_be_read_is_refused_with_its_reason(name, tmp_path):
    if name == "IsADirectoryError":
        (tmp_path / "report.json").mkdir()
    elif name == "UnicodeDecodeError":
        (tmp_path / "report.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(InputError) as caught:
        read_report(tmp_path)
    assert name in caught.value.bound


def test_edited_report_is_not_believed(tmp_path):
    write_outputs(result_of(), tmp_path)
    path = tmp_path / "report.json"
    data = read_data(tmp_path)
    path.write_text(json.dumps(put(data, ("springs", "K_l_N_per_m"), 1000.0)), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_report(tmp_path)
    assert "digest" in caught.value.bound
    path.write_text(json.dumps(data), encoding="utf-8")
    assert read_report(tmp_path).design == Design()


def test_keys_of_later_versions_are_left_alone(report, tmp_path):
    later = put(put(report, ("modulus",), 3), ("response", 0, "E_error"), [1])
    assert report_of(tmp_path, later) == report_of(tmp_path, report)


def test_report_of_an_older_version_is_read_where_its_former_keys_did_nothing(report, tmp_path):
    former = report_of(tmp_path, put(report, ("design",), with_former_defaults(report["design"])))
    assert former == report_of(tmp_path, report)
    with pytest.raises(InputError) as caught:
        report_of(tmp_path, put(report, ("design", "press", "strain"), "large"))
    assert caught.value.field == "PATH"
    assert "press.strain" in caught.value.bound
    assert "\n" not in str(caught.value)


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

"""What is read as TOML, and the one line that says why a file is not."""

from pathlib import Path

import pytest

from cad import toml_file
from cad.quantity import InputError
from cad.toml_file import read_toml


@pytest.mark.parametrize(
    "content",
    [b"a = ", b"a = 1\na = 2", b"\xff\xfe", b"a = " + 3000 * b"[" + 3000 * b"]", b"a = " + 5000 * b"1"],
    ids=["no value", "twice", "not text", "nested", "digits"],
)
def test_what_is_no_toml_is_one_line(tmp_path, content):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_toml(path, "table")
    assert str(error.value).startswith("table: ")
    assert "\n" not in str(error.value)


def test_missing_file_folder_and_endless_file_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(toml_file, "LARGEST_BYTES", 1000)
    for path in (tmp_path / "none.toml", tmp_path, Path("/dev/zero")):
        with pytest.raises(InputError):
            read_toml(path, "table")


def test_byte_order_mark_is_no_part_of_the_file(tmp_path):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\n")
    assert read_toml(path, "table") == {"a": 1}

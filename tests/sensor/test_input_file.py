"""What is read of a file from outside, and the one line that says why it is not."""

import os
from pathlib import Path

import pytest

from sensor.input_file import MOST_LEVELS, read_bytes, read_toml
from sensor.quantity import InputError


def nested(levels):
    """Return TOML whose tables and lists reach so many levels below the table of the file."""
    return b"a = " + (levels - 1) * b"[" + b"1" + (levels - 1) * b"]"


@pytest.mark.parametrize(
    "content",
    [
        b"a = ",
        b"a = 1\na = 2",
        b"\xff\xfea",
        b"a = " + 5000 * b"1",
        nested(MOST_LEVELS + 1),
        nested(3000),
        b"[" + b".".join(500_000 * [b"a"]) + b"]\nb = 1",  # whose parsing would take hours
        b"a = {" + b" . ".join(500_000 * [b"'a b'"]) + b" = 1}",
    ],
    ids=["no value", "twice", "not text", "digits", "one level too deep", "nested", "nested by dots", "quoted"],
)
def test_what_is_no_toml_is_one_line(tmp_path, content):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_toml(path, "table")
    assert (error.value.field, error.value.value) == ("table", str(path))
    assert "\n" not in str(error.value)


def test_deepest_toml_and_byte_order_mark_are_read(tmp_path):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + nested(MOST_LEVELS) + b"\r\n")
    value = read_toml(path, "table")["a"]
    for _ in range(MOST_LEVELS - 1):
        (value,) = value
    assert value == 1
    path.write_text(f"# 1. 2. 3. 4. ...................\n{'a.' * (MOST_LEVELS - 2)}a = [0.1{16 * ', 0.5'}]", "utf-8")
    assert "a" in read_toml(path, "table")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16-le", "utf-16-be"])
def test_text_of_any_unicode_is_read(encoding, tmp_path):
    mark = "\ufeff" if encoding.startswith("utf-16") else ""
    (tmp_path / "design.toml").write_bytes(f'{mark}# größe\r\nname = "größe"\r\n'.encode(encoding))
    assert read_toml(tmp_path / "design.toml", "table") == {"name": "größe"}


@pytest.mark.parametrize("before", [0, 1, 7])
def test_line_that_is_no_unicode_is_named(before, tmp_path):
    (tmp_path / "design.toml").write_bytes(before * b"a = 1\n" + "# größe\nb = 1\n".encode("latin-1"))
    with pytest.raises(InputError, match=rf"\bline {before + 1}\b"):
        read_toml(tmp_path / "design.toml", "table")


@pytest.mark.parametrize("size", [0, 16 * 1024 * 1024])
def test_regular_file_up_to_the_bound_is_read_whole(size, tmp_path):
    (tmp_path / "file").write_bytes(size * b"x")
    assert read_bytes(tmp_path / "file", "FILE") == size * b"x"


def test_no_other_file_is_waited_for_or_read(tmp_path):
    """A pipe without a writer would be waited for, a device has no end."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/zero")
    with (tmp_path / "large").open("wb") as file:
        file.truncate(16 * 1024 * 1024 + 1)
    names = ("pipe", "device", "large", "none", ".", "x" * 300, "no\0file")
    for path in (tmp_path / name for name in names):
        with pytest.raises(InputError) as error:
            read_bytes(path, "FILE")
        assert (error.value.field, error.value.value) == ("FILE", str(path))


def test_file_that_cannot_be_read_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setattr(Path, "open", lambda *_, **__: (_ for _ in ()).throw(PermissionError(13, "Permission denied")))
    with pytest.raises(InputError) as error:
        read_bytes(tmp_path / "file", "FILE")
    assert error.value.bound == "a file that can be read (Permission denied)"

"""A file that a command writes where it is told to is new, whole, UTF-8, or refused in one line."""

import pytest

from cad.quantity import InputError
from pipeline.storage.new_file import refuse_unwritable, write_new


def test_file_that_is_there_stays_unless_forced(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match="must be a file that is not there yet; choose another name, or add --force"):
        write_new(path, "ν", "--out")
    assert path.read_text(encoding="utf-8") == "mine"
    write_new(path, "ν", "--out", force=True)
    assert path.read_bytes() == "ν".encode()
    assert [one.name for one in tmp_path.iterdir()] == ["a.toml"]


def test_dangling_link_stays_and_its_end_is_not_written(tmp_path):
    path = tmp_path / "a.toml"
    path.symlink_to(tmp_path / "elsewhere")
    for write in (lambda: write_new(path, "x", "--out"), lambda: refuse_unwritable(path, "--out")):
        with pytest.raises(InputError, match="not there yet"):
            write()
    assert path.is_symlink()
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize(
    "write", [lambda path: write_new(path, "x", "--out"), lambda path: refuse_unwritable(path, "--out")]
)
def test_place_that_takes_no_file_is_refused(write, tmp_path):
    """A path below a file, and a name longer than file systems take."""
    (tmp_path / "file").touch()
    for path in (tmp_path / "file" / "a.toml", tmp_path / f"{'a' * 300}.toml"):
        with pytest.raises(InputError, match=r"^--out = .*: must be a place that can be written"):
            write(path)
    assert [one.name for one in tmp_path.iterdir()] == ["file"]


def test_attempt_leaves_nothing(tmp_path):
    refuse_unwritable(tmp_path / "a.toml", "--out")
    assert list(tmp_path.iterdir()) == []

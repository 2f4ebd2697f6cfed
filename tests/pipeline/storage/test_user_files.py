"""Nothing of a person's is lost: 30 kinds of files in output folders, and every command that writes into one."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.cli import main
from pipeline.report.outputs import file_entries
from pipeline.storage import folder as outputs
from pipeline.storage.belongings import foreign_files, keep_aside
from pipeline.storage.folder import OutputError, output_folder
from pipeline.storage.placed_files import place_file, place_files
from pipeline.storage.seal import has_seal, sealed, sealed_mapping
from pipeline.view import pictures

PRECIOUS = "precious \u00b1\n"
PNG = b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + bytes(17) + b"\0\0\0\0IEND\xaeB`\x82"
NAMES = ("design.toml", "housing.stl", "response.csv")


def written(folder: Path, text: str = "old") -> Path:
    """Return a folder as a run leaves it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        (folder / name).write_text(text, encoding="utf-8")
    report = sealed_mapping({"schema": 1, "text": text, "files": file_entries(folder)})
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    return folder


def text_file(name: str) -> Callable[[Path], Path]:
    def plant(folder: Path) -> Path:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(PRECIOUS, encoding="utf-8")
        return folder / name.partition("/")[0]

    return plant


def changed(name: str, change: Callable[[bytes], bytes]) -> Callable[[Path], Path]:
    def plant(folder: Path) -> Path:
        path = folder / name
        path.write_bytes(change(path.read_bytes()))
        return path

    return plant


def link(name: str, target: str) -> Callable[[Path], Path]:
    def plant(folder: Path) -> Path:
        path = folder / name
        path.unlink(missing_ok=True)
        path.symlink_to(target)
        return path

    return plant


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe")
    return folder / "pipe"


def empty_folder(folder: Path) -> Path:
    (folder / "photos").mkdir()
    return folder / "photos"


def twin_of_a_listed_file(folder: Path) -> Path:
    """Plant the bytes of a listed file under another name."""
    (folder / "housing copy.stl").write_bytes((folder / "housing.stl").read_bytes())
    return folder / "housing copy.stl"


def link_to_the_same_bytes(folder: Path) -> Path:
    """Move a listed file elsewhere and leave a link to it."""
    (folder / "housing.stl").rename(folder.parent / "elsewhere.stl")
    (folder / "housing.stl").symlink_to(folder.parent / "elsewhere.stl")
    return folder / "housing.stl"


def folder_in_the_place_of_a_file(folder: Path) -> Path:
    (folder / "housing.stl").unlink()
    return text_file("housing.stl/inside.txt")(folder)


def foreign_report(folder: Path) -> Path:
    (folder / "report.json").write_text('{"schema": 1, "files": [], "mine": true}', encoding="utf-8")
    return folder / "report.json"


def report_that_lists_more(folder: Path) -> Path:
    """Add a file to the report by hand, so that its digest is no longer that of a run."""
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    report["files"].append({"path": "photo.png", "sha256": "0" * 64})
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    return folder / "report.json"


KINDS: dict[str, Callable[[Path], Path]] = {
    "a photo": text_file("photo.png"),
    "a picture of one of our names": text_file("housing.png"),
    "notes": text_file("notes.txt"),
    "measurements": text_file("measured.csv"),
    "a calibrated coupon": text_file("coupon.3mf"),
    "a file of our name that this run did not write": text_file("cover.step"),
    "an edited design": changed("design.toml", lambda data: data + b"# my change\n"),
    "an emptied table": changed("response.csv", lambda _: b""),
    "a table with other line ends": changed("response.csv", lambda data: data + b"\r\n"),
    "a sliced part": changed("housing.stl", lambda data: data[::-1]),
    "a foreign report": foreign_report,
    "a report with another number": changed("report.json", lambda data: data.replace(b"old", b"new")),
    "a report that lists more": report_that_lists_more,
    "a report that is no JSON": changed("report.json", lambda data: data[:-1]),
    "a hidden file": text_file(".hidden"),
    "a lock of an office program": text_file(".~lock.response.csv#"),
    "a file in a folder": text_file("photos/first.jpg"),
    "a file deep down": text_file("a/b/c/d/e.txt"),
    "a folder of versions": text_file(".git/config"),
    "an empty folder": empty_folder,
    "a folder in the place of a file": folder_in_the_place_of_a_file,
    "a link to nowhere": link("link", "nowhere"),
    "a link to itself": link("loop", "loop"),
    "a link out of the folder": link("outside", ".."),
    "a link to the same bytes": link_to_the_same_bytes,
    "a named pipe": pipe,
    "a copy of a listed file": twin_of_a_listed_file,
    "a name with markup and blanks": text_file("[b]bold[/b] it's \u00b1.txt"),
    "a name with a line break": text_file("two\nlines"),
    "a name that fills the file system": text_file("n" * 255),
    "a backup of an earlier time": text_file("design.toml.bak"),
}


def contents(folder: Path) -> dict[str, object]:
    """Return what lies below a folder: bytes, targets of links, kinds, by the path."""
    found: dict[str, object] = {}
    for path in sorted(folder.rglob("*")):
        kind = "link" if path.is_symlink() else "folder" if path.is_dir() else "file" if path.is_file() else "other"
        value = {"link": os.readlink, "file": Path.read_bytes}.get(kind, lambda _: b"")(path)
        found[path.relative_to(folder).as_posix()] = (kind, value)
    return found


def kept_as(name: str) -> str:
    return name if name.endswith(".bak") else name[:240] + ".bak"


@pytest.mark.parametrize("command", ["run", "design"])
@pytest.mark.parametrize("kind", KINDS)
def test_person_s_file_is_refused_by_its_name_and_nothing_is_touched(kind, command, tmp_path, stand_in_run, capsys):
    folder = written(tmp_path / "out")
    planted = KINDS[kind](folder)
    before = contents(tmp_path)
    assert main([command, "--out", str(folder)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert repr(planted.name) in err
    assert "keep them as NAME.bak with --force" in err
    assert contents(tmp_path) == before
    assert stand_in_run.asked == []


@pytest.mark.parametrize("kind", KINDS)
def test_force_keeps_it_aside_again_and_again(kind, tmp_path, stand_in_run):
    folder = written(tmp_path / "out")
    planted = KINDS[kind](folder)
    before = contents(folder)
    mine = {name: value for name, value in before.items() if name.partition("/")[0] == planted.name}
    for _ in range(3):
        assert main(["run", "--out", str(folder), "--force"]) == 0
        after = contents(folder)
        assert {kept_as(planted.name) + name[len(planted.name) :] for name in mine} <= set(after)
        assert {after[kept_as(planted.name) + name[len(planted.name) :]] for name in mine} == set(mine.values())
    assert len(stand_in_run.asked) == 3
    assert sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(".out")) == []


def test_every_backup_has_a_place_of_its_own(tmp_path):
    folder = written(tmp_path / "out")
    for text in ("first", "second", "third"):
        (folder / "design.toml").write_text(text, encoding="utf-8")
        with output_folder(folder, force=True) as new:
            written(new, text)
    names = ("design.toml.bak", "design.toml.bak.1", "design.toml.bak.2")
    assert sorted((folder / name).read_text(encoding="utf-8") for name in names) == ["first", "second", "third"]


def test_kept_name_is_not_taken_twice(tmp_path):
    for text in ("a", "b", "c"):
        (tmp_path / "x.bak").write_text(text, encoding="utf-8")
        (tmp_path / "kept").mkdir(exist_ok=True)
        keep_aside(tmp_path / "x.bak", tmp_path / "kept")
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == ["x.bak", "x.bak.1", "x.bak.2"]


@pytest.mark.parametrize("force", [False, True])
def test_file_that_comes_between_the_last_look_and_the_exchange_is_not_lost(force, tmp_path, monkeypatch):
    folder = written(tmp_path / "out")
    rename = Path.rename

    def comes_late(self, to):
        if self == folder:
            (folder / "late.txt").write_text(PRECIOUS, encoding="utf-8")
        return rename(self, to)

    monkeypatch.setattr(Path, "rename", comes_late)
    if force:
        with output_folder(folder, force=True) as new:
            written(new, "new")
        assert (folder / "late.txt.bak").read_text(encoding="utf-8") == PRECIOUS
        assert (folder / "housing.stl").read_text(encoding="utf-8") == "new"
    else:
        with pytest.raises(OutputError, match=r"holds 'late.txt'"), output_folder(folder) as new:
            written(new, "new")
        assert (folder / "late.txt").read_text(encoding="utf-8") == PRECIOUS
        assert (folder / "housing.stl").read_text(encoding="utf-8") == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_file_left_in_a_folder_that_a_killed_run_had_moved_aside_is_kept(tmp_path):
    written(tmp_path / "out")
    aside = written(tmp_path / ".out.twintip-old")
    (aside / "notes.txt").write_text(PRECIOUS, encoding="utf-8")
    with pytest.raises(OutputError, match=r"holds 'notes.txt.bak'"), output_folder(tmp_path / "out"):
        pytest.fail("the work began")
    assert (tmp_path / "out" / "notes.txt.bak").read_text(encoding="utf-8") == PRECIOUS
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_kill_while_the_old_files_are_dropped_leaves_only_ours(tmp_path, monkeypatch):
    """Files go before the report that lists them, so that what is left can still be told from a person's."""
    folder, unlink, gone = written(tmp_path / "out"), Path.unlink, []

    def killed(self, **keywords):
        if "twintip-old" in str(self):
            gone.append(self.name)
            if len(gone) == 3:
                raise KeyboardInterrupt
        return unlink(self, **keywords)

    monkeypatch.setattr(Path, "unlink", killed)
    with pytest.raises(KeyboardInterrupt), output_folder(folder) as new:
        written(new, "new")
    monkeypatch.undo()
    with output_folder(folder) as new:
        written(new, "newer")
    assert foreign_files(folder) == []
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_mode_of_the_folder_stays(tmp_path):
    folder = written(tmp_path / "out")
    folder.chmod(0o750)
    with output_folder(folder) as new:
        written(new, "new")
    assert folder.stat().st_mode & 0o777 == 0o750


def test_lock_of_a_person_s_own_is_not_taken(tmp_path):
    lock = tmp_path / ".out.twintip-lock"
    lock.write_text(PRECIOUS, encoding="utf-8")
    with pytest.raises(OutputError, match=r"lock"), output_folder(tmp_path / "out"):
        pytest.fail("the work began")
    assert lock.read_text(encoding="utf-8") == PRECIOUS


SINGLE = {"page.md": b"# page\n", "page.svg": b"<svg/>\n", "records.json": b'{"a": [1.5, null]}', "part.png": PNG}


@pytest.mark.parametrize("name", SINGLE)
def test_single_file_is_ours_until_one_byte_of_it_changes(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(SINGLE[name])
    assert not has_seal(path)
    content = sealed(name, SINGLE[name])
    path.write_bytes(content)
    assert has_seal(path)
    for place in range(0, len(content), 7):
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        assert not has_seal(path), place


@pytest.mark.parametrize("name", SINGLE)
def test_single_file_of_a_person_is_refused_and_kept_with_force(name, tmp_path):
    place_files(tmp_path, {name: SINGLE[name]}, "--out")
    place_files(tmp_path, {name: SINGLE[name]}, "--out")
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content + b" ")
    if name == "records.json":
        (tmp_path / name).write_bytes(content.replace(b"1.5", b"2.5"))
    mine = (tmp_path / name).read_bytes()
    before = contents(tmp_path)
    with pytest.raises(ValueError, match=rf"--out = .*its '{name}' is none; name another folder with --out"):
        place_files(tmp_path, {"other.md": b"x", name: SINGLE[name]}, "--out")
    assert contents(tmp_path) == before
    place_files(tmp_path, {name: SINGLE[name]}, "--out", force=True)
    assert (tmp_path / f"{name}.bak").read_bytes() == mine
    assert (tmp_path / name).read_bytes() == content


def test_folder_of_a_run_is_refused_for_single_files_and_takes_its_next_run(tmp_path):
    folder = written(tmp_path / "paper")
    before = contents(folder)
    with pytest.raises(ValueError, match=r"^--png = '.*paper': must be a folder that is not the output folder of a ru"):
        place_files(folder, {"housing.png": PNG}, "--png")
    with pytest.raises(ValueError, match=r"^--html = '.*paper/x.html': must be a file outside the output folder of a"):
        place_file(folder / "x.html", b"<p>", "--html")
    assert contents(folder) == before
    assert foreign_files(folder) == []


def test_message_on_a_file_names_the_file(tmp_path):
    mine = tmp_path / "mine.html"
    mine.write_text(PRECIOUS, encoding="utf-8")
    with pytest.raises(ValueError, match=r"^--html = '.*mine.html': must be a new file, or .*; name another file with"):
        place_file(mine, b"<p>", "--html")
    with pytest.raises(
        ValueError, match=r"^--html = '.*in.html': must be a file that can be written \(.*\); name anot"
    ):
        place_file(mine / "in.html", b"<p>", "--html")
    assert mine.read_text(encoding="utf-8") == PRECIOUS


def test_single_file_that_changes_after_the_look_is_put_back(tmp_path, monkeypatch):
    place_files(tmp_path, {"page.md": b"old\n"}, "--out")
    rename = Path.rename

    def comes_late(self, to):
        if self == tmp_path / "page.md":
            self.write_text(PRECIOUS, encoding="utf-8")
        return rename(self, to)

    monkeypatch.setattr(Path, "rename", comes_late)
    with pytest.raises(ValueError, match="is none"):
        place_files(tmp_path, {"page.md": b"new\n"}, "--out")
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == PRECIOUS


def test_pictures_replace_pictures_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "SIZE", (8, 8))
    shown = [pictures.Picture(name="housing", draw=lambda plotter: plotter.add_title("housing"))]
    for _ in range(2):
        assert pictures.write_pictures(shown, tmp_path) == [tmp_path / "housing.png"]
    (tmp_path / "housing.png").write_text(PRECIOUS, encoding="utf-8")
    with pytest.raises(ValueError, match=r"--png = .*its 'housing.png' is none"):
        pictures.write_pictures(shown, tmp_path)
    pictures.write_pictures(shown, tmp_path, force=True)
    assert (tmp_path / "housing.png.bak").read_text(encoding="utf-8") == PRECIOUS


@pytest.mark.parametrize("words", ["bench", "bench --hard"])
def test_bench_refuses_before_it_measures(words, tmp_path, capsys):
    for name in ("benchmarks.md", "hard-cases.md"):
        (tmp_path / name).write_text(PRECIOUS, encoding="utf-8")
    before = contents(tmp_path)
    assert main([*words.split(), "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert contents(tmp_path) == before


def test_planted_careless_drop_would_lose_a_file(tmp_path, monkeypatch):
    """The kinds above do find an exchange that removes the whole old folder."""
    folder = written(tmp_path / "out")
    text_file("photo.png")(folder)
    monkeypatch.setattr(outputs, "_drop", lambda old, _target: outputs.shutil.rmtree(old))
    with output_folder(folder, force=True) as new:
        written(new, "new")
    assert PRECIOUS.encode() not in [value for _, value in contents(tmp_path).values()]

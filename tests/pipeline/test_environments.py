"""Odd machines and callers: a command ends as it should or says in one line what is missing, never in a traceback."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from pipeline.cli import main; sys.exit(main())"
DONE, REFUSED = (0, 1), (2,)
SECONDS = 120  # until a command is taken to hang


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a command runs: variables (None takes one away), what the shell does before, where its streams go."""

    variables: tuple[tuple[str, str | None], ...] = ()
    before: str = "true"
    streams: str = ""
    codes: tuple[int, ...] = DONE
    reads: bool = True  # whether stdout comes to us


def with_variables(codes: tuple[int, ...] = DONE, **variables: str | None) -> Place:
    return Place(variables=tuple(variables.items()), codes=codes)


EITHER = (*DONE, *REFUSED)
GONE = "mkdir gone && cd gone && rmdir ../gone"
PLACES = {
    "as it is": Place(),
    "stdout closed": Place(streams=">&-", reads=False),
    "stdin closed": Place(streams="<&-"),
    "stderr closed": Place(streams="2>&-"),
    "every stream closed": Place(streams="<&- >&- 2>&-", reads=False),
    "stdout full": Place(streams=">/dev/full", reads=False, codes=EITHER),
    "stderr full": Place(streams="2>/dev/full"),
    "stdout and stderr full": Place(streams=">/dev/full 2>&1", reads=False, codes=EITHER),
    "stdout in ASCII": with_variables(PYTHONIOENCODING="ascii", LC_ALL="C"),
    "stdout in Latin-1": with_variables(PYTHONIOENCODING="latin-1"),
    "unknown language": with_variables(LC_ALL="xx_YY.nothing", LANG="C"),
    "no home": with_variables(HOME=None, XDG_CACHE_HOME=None),
    "an empty home": with_variables(HOME="", XDG_CACHE_HOME=""),
    "a home that is not there": with_variables(HOME="/nonexistent", XDG_CACHE_HOME=None),
    "a relative home": with_variables(HOME="here", XDG_CACHE_HOME="there"),
    "a cache that is a file": with_variables(XDG_CACHE_HOME="/dev/null"),
    "a cache that cannot be made": with_variables(XDG_CACHE_HOME="/proc/cache"),
    "no place for temporary files": with_variables(EITHER, TMPDIR="/nonexistent", TEMP="", TMP=""),
    "no PATH": with_variables(PATH=""),
    "warnings are errors": with_variables(PYTHONWARNINGS="error"),
    "a date that is none": with_variables(EITHER, SOURCE_DATE_EPOCH="tomorrow"),
    "a date before 1970": with_variables(EITHER, SOURCE_DATE_EPOCH="-1"),
    "a date beyond all years": with_variables(EITHER, SOURCE_DATE_EPOCH="9" * 30),
    "an empty date": with_variables(EITHER, SOURCE_DATE_EPOCH=""),
    "threads that are no number": with_variables(OMP_NUM_THREADS="many"),
    "a terminal of no width": with_variables(COLUMNS="0", LINES="-1", TERM="dumb", FORCE_COLOR="1"),
    "a time zone that is none": with_variables(TZ=":::"),
    "without docstrings": with_variables(PYTHONOPTIMIZE="2"),
    "a removed folder": Place(before=GONE, codes=REFUSED),
    "no file may grow": Place(before="ulimit -f 0", codes=EITHER),
    "files up to 100 KiB": Place(before="ulimit -f 100", codes=EITHER),
    "memory of 1.2 GB": Place(before="ulimit -v 1200000", codes=REFUSED),
    "data of 1 GB": Place(before="ulimit -d 1000000", codes=REFUSED),
    "16 open files": Place(before="ulimit -n 16", codes=EITHER),
    "files for nobody": Place(before="umask 0777", codes=EITHER),
}
LIGHT = ("design --list-processes --json", "run --set tips.side_mm=-1", "check nowhere.step")


def ended(place: Place, words: str, folder: Path) -> tuple[int, str, str]:
    """Return exit code, stdout and stderr of a command in a place."""
    # Streams that are not buffered would hide what a stream holds at exit.
    variables = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONUNBUFFERED": None, **dict(place.variables)}
    line = f'{place.before}; exec "{sys.executable}" -c "$0" {words} {place.streams}'
    done = subprocess.run(
        [shutil.which("bash") or "bash", "-c", line, PROGRAM],
        cwd=folder,
        env={name: value for name, value in variables.items() if value is not None},
        capture_output=True,
        timeout=SECONDS,
        check=False,
    )
    said = done.stderr.decode(errors="replace").splitlines(keepends=True)
    by_shell = [line for line in said if "setlocale" in line]
    err = "".join(line for line in said if line not in by_shell)
    return done.returncode, done.stdout.decode(errors="replace"), err


def check_ended(place: Place, words: str, folder: Path, codes: tuple[int, ...]) -> None:
    code, out, err = ended(place, words, folder)
    assert "Traceback" not in out + err
    assert code in codes, (code, err)
    if code == 2 and "2>" not in place.streams:
        assert (out, err.count("\n"), err.startswith("pipeline: ")) == ("", 1, True), err
    if code in DONE and place.reads:
        assert out


@pytest.mark.slow
@pytest.mark.parametrize("words", LIGHT)
@pytest.mark.parametrize("name", PLACES)
def test_light_command_ends_well_or_in_a_line(name, words, tmp_path):
    """Of 105 runs; what is refused without a machine's fault is refused with one too."""
    place = PLACES[name]
    expected = (0, 2) if "full" in place.streams else (0,)
    codes = REFUSED if words != LIGHT[0] or place.codes == REFUSED else expected
    check_ended(place, words, tmp_path, codes)


@pytest.mark.study
@pytest.mark.parametrize("name", PLACES)
def test_run_ends_with_its_outputs_or_in_a_line(name, tmp_path):
    place = PLACES[name]
    check_ended(place, "run --out '[/b]out'", tmp_path, place.codes if "full" not in place.streams else DONE)
    left = sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(".") and "twintip" in path.name)
    assert left == []
    if (tmp_path / "[/b]out").exists() and place.before != "umask 0777":
        assert {"report.json", "housing.step", "response.csv"} <= {
            path.name for path in (tmp_path / "[/b]out").iterdir()
        }


def test_planted_traceback_is_seen(tmp_path):
    with pytest.raises(AssertionError):
        check_ended(Place(before='set -- ; echo "Traceback" >&2'), LIGHT[0], tmp_path, DONE)

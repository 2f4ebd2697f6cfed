"""The completion scripts name every command and the names that flags take, and shells can read them."""

import shutil
import subprocess
from pathlib import Path

import pytest

from cad.design.processes import PROCESSES
from pipeline.cli import COMMANDS, command_parsers, main
from pipeline.commands.completion import completion
from pipeline.options import preset_names


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_script_knows_commands_presets_processes_and_names(shell, capsys):
    assert main(["--print-completion", shell]) == 0
    script = capsys.readouterr().out
    for word in (*COMMANDS, *PROCESSES, *preset_names(), "reading.bias", "press.travel_mm"):
        assert word in script


@pytest.mark.parametrize("words", [["fish"], [], ["bash", "more"]])
def test_other_shell_is_refused_in_a_line(words, capsys):
    assert main(["--print-completion", *words]) == 2
    assert "must be one of bash, zsh, tcsh" in capsys.readouterr().err


def bash_completions(line, script, folder):
    """Return what bash offers for the last word of a line typed in a folder."""
    words = line.split(" ")
    typed = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}"
    program = f'source {script}; {typed}; _shtab_pipeline; echo "${{COMPREPLY[@]}}"'
    done = subprocess.run(
        ["bash", "-c", program], cwd=folder, capture_output=True, encoding="utf-8", check=True, timeout=60
    )
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes_files_folders_and_presets_as_each_command_takes_them(tmp_path, capsys):
    assert main(["--print-completion", "bash"]) == 0
    script = tmp_path / "pipeline.bash"
    script.write_text(capsys.readouterr().out, encoding="utf-8")
    (tmp_path / "zz_file").touch()
    (tmp_path / "zz_folder").mkdir()
    assert bash_completions("pipeline suggest pap", script, tmp_path) == ["paper", "paper-on-mango"]
    for line in (
        "suggest --out", "calibrate --out", "view --html", "study", "optimise", "study --export", "read --c-header",
        "read --micropython", "read --unit", "modulus", "modulus --plot",
    ):  # fmt: skip
        assert "zz_file" in bash_completions(f"pipeline {line} zz", script, tmp_path), line
    for line in (
        "run --out",
        "design --out",
        "study --out",
        "view --pvd",
        "view --png",
        "view",
    ):
        assert bash_completions(f"pipeline {line} zz", script, tmp_path) == ["zz_folder"], line


def test_every_path_is_completed():
    parser, parsers = command_parsers()
    completion(parser, parsers, ["bash"])
    paths = [action for each in parsers.values() for action in each._actions if action.type is Path]
    assert len(paths) > 20
    assert [action.dest for action in paths if not hasattr(action, "complete")] == []

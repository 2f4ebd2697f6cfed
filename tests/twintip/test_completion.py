"""The script of a shell completes commands, flags, presets, processes and folders."""

import re
import shutil

import pytest
from programs import ended

from sensor.quantity import InputError
from twintip import cli
from twintip.flags import COMMANDS

ASK = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_shtab_pipeline
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    path = tmp_path_factory.mktemp("completion") / "pipeline.bash"
    path.write_text(cli.completion(["--completion", "bash"]), encoding="utf-8")
    return path


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([""], sorted(COMMANDS)),
        (["run", "--fru"], ["--fruit-stiffness"]),
        (["run", "ma"], ["mango"]),
        (["run", "--process", "s"], ["sla-resin", "sls-pa12"]),
        (["run", "--out", "o"], ["outputs"]),
    ],
    ids=" ".join,
)
def test_bash_completes_a_word(script, tmp_path, words, expected):
    (tmp_path / "outputs").mkdir()
    (tmp_path / "other.txt").touch()
    done = ended("bash", "-c", ASK, "bash", script, "pipeline", *words, cwd=tmp_path)
    assert sorted(done.stdout.split()) == expected
    assert done.stderr == ""


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_a_script(shell, capsys):
    for words in (["--completion", shell], [f"--completion={shell}"]):
        assert cli.main(words) == 0
        printed = capsys.readouterr().out
        assert [name for name in COMMANDS if not re.search(rf"\b{name}\b", printed)] == []


@pytest.mark.parametrize("words", [["--completion"], ["--completion", "dos"], ["--completion=dos"]])
def test_other_shell_is_refused(words):
    with pytest.raises(InputError) as raised:
        cli.completion(words)
    assert raised.value.field == "--completion"
    assert cli.main(words) == cli.WRONG_INPUT

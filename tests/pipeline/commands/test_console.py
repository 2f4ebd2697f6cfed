"""How commands speak: JSON without numbers that are none, and quiet when the reader has left."""

import io
import json
import subprocess
import sys
from argparse import ArgumentParser

import pytest

from pipeline.commands import console
from pipeline.commands.console import add_json_flag, answering, print_json


def test_json_is_readable_and_reads_back(capsys):
    print_json({"name": "Kirsche · ±", "P": [1.0, None]})
    text = capsys.readouterr().out
    assert "Kirsche · ±" in text
    assert json.loads(text) == {"name": "Kirsche · ±", "P": [1.0, None]}


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_number_that_is_none_is_not_printed(value, capsys):
    with pytest.raises(ValueError, match="not JSON compliant"):
        print_json({"P": value})
    assert capsys.readouterr().out == ""


def test_flag_is_off_until_it_is_given():
    parser = ArgumentParser()
    add_json_flag(parser)
    assert [parser.parse_args(words).json for words in ([], ["--json"])] == [False, True]


def test_dropped_output_goes_nowhere_and_is_no_error():
    program = "from pipeline.commands.console import drop_output; drop_output(); print('unread', flush=True)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    assert (done.stdout, done.stderr) == ("", "")


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (BrokenPipeError(), ""),
        (SystemExit(1), ""),
        (OSError(28, "No space left on device"), "pipeline: the answer cannot be printed: No space left on device; "),
    ],
)
def test_answer_that_nobody_takes_does_not_undo_the_work(error, said, monkeypatch, capsys):
    dropped = []
    monkeypatch.setattr(console, "drop_output", lambda: dropped.append(True))
    with answering():
        raise error
    assert dropped == [True]
    assert capsys.readouterr().err.startswith(said)


def test_error_of_another_kind_is_not_taken_for_that_of_an_output():
    with pytest.raises(TypeError, match="a bug"), answering():
        raise TypeError("a bug")


def test_json_is_ascii_where_the_output_takes_no_more(monkeypatch):
    written = io.BytesIO()
    with io.TextIOWrapper(written, encoding="ascii") as narrow:
        monkeypatch.setattr(console.sys, "stdout", narrow)
        print_json({"name": "±"})
        narrow.flush()
        assert json.loads(written.getvalue()) == {"name": "±"}

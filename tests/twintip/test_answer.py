"""An answer is printed as data or as text; a reader that has left ends a stream and undoes nothing else."""

import json
from pathlib import Path

import pytest
from rich.table import Table

from instrument.compress.pressed_shapes import KINDS
from sensor.design.processes import PROCESSES
from twintip.commands import console
from twintip.commands.console import Answer, print_answer
from twintip.flags import BODIES, DEFAULT_PROCESS

TABLE = Table("head")
DATA = {"a": [1.5, None], "b": "c"}


@pytest.mark.parametrize(
    ("answer", "as_json", "out", "err"),
    [
        (Answer(code=0, data=DATA, text="text"), False, "text\n", ""),
        (Answer(code=0, data=DATA, text="[red]text[/]"), False, "[red]text[/]\n", ""),
        (Answer(code=0, data=DATA, text="text"), True, json.dumps(DATA, indent=2) + "\n", ""),
        (Answer(code=0, data=[1], text="t", of_stream=True), True, "[1]\n", ""),
        (Answer(code=0, data=[], text="t"), True, "[]\n", ""),
        (Answer(code=0, text="text"), True, "", ""),
        (Answer(code=0, files=[Path("a"), Path("b")]), False, "a\nb\n", ""),
        (Answer(code=0, files=[Path("a"), Path("b")]), True, "", "a\nb\n"),
        (Answer(code=0, parts=["[b]x[/]", "y"], text="z"), False, "x\ny\nz\n", ""),
        (Answer(code=0, parts=["12 45 78"], width=5), False, "12 45\n78\n", ""),
    ],
)
def test_answer_is_printed_as_data_or_as_text(answer, as_json, out, err, capsys):
    print_answer(answer, as_json=as_json)
    assert capsys.readouterr() == (out, err)


@pytest.mark.parametrize("of_stream", [False, True])
def test_reader_that_has_left_ends_a_stream_only(of_stream, monkeypatch):
    def leave(*_, **__):
        raise BrokenPipeError

    dropped = []
    monkeypatch.setattr("builtins.print", leave)
    monkeypatch.setattr(console, "drop_output", lambda: dropped.append(True))
    if of_stream:
        with pytest.raises(BrokenPipeError):
            print_answer(Answer(code=0, text="x", of_stream=True), as_json=False)
    else:
        print_answer(Answer(code=0, text="x"), as_json=False)
    assert dropped == [True] * (not of_stream)


def test_choices_of_flags_are_those_of_the_code():
    assert tuple(KINDS) == BODIES
    assert DEFAULT_PROCESS in PROCESSES

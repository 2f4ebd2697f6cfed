"""An answer is printed as data or as text; a reader that has left ends a stream and undoes nothing else."""

import json
from pathlib import Path

import pytest

from instrument.compress.pressed_shapes import KINDS
from sensor.design.processes import PROCESSES
from twintip.commands.console import Answer, print_answer
from twintip.flags import BODIES, DEFAULT_PROCESS

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


def test_choices_of_flags_are_those_of_the_code():
    assert tuple(KINDS) == BODIES
    assert DEFAULT_PROCESS in PROCESSES

"""How commands speak: JSON without numbers that are none, and quiet when the reader has left."""

import json
import subprocess
import sys
from argparse import ArgumentParser

import pytest

from pipeline.commands.console import add_json_flag, print_json


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

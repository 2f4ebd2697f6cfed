"""README.md: `make run` prints the answer that it shows, and code hosts render its tables, picture and links."""

import re
from pathlib import Path

import pytest

from twintip.cli import main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e-?\d+)?")
ROUND_OFF = 2e-3  # of a number: meshes and sums differ from processor to processor by less


def told(text):
    """Return the words of an answer without its frames, and its numbers."""
    plain = " ".join(re.sub(r"[│┃━─┏┓┡┩├┤└┘┬┴┼╇┳╈]+", " ", text).split())
    return NUMBER.sub("N", plain), [float(number) for number in NUMBER.findall(plain)]


@pytest.mark.slow
def test_answer_is_what_the_command_prints(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--nl", "0.05"]) == 0
    shown = re.search(r"<!-- answer of make run -->\n```text\n(.+?)^```", README, flags=re.MULTILINE | re.DOTALL)
    assert shown is not None
    words, numbers = told(shown[1])
    printed_words, printed = told(capsys.readouterr().out)
    assert printed_words == words
    assert printed == pytest.approx(numbers, rel=ROUND_OFF, abs=1e-9)

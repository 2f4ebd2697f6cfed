"""Eleven scenes answer what they answered before: a number that moves is a fault, or a correction with its reason.

The paper's is compared in every run of the tests too: its numbers in tests/pipeline/test_run.py, the files of its
design in tests/docs/test_report_keys.py.
"""

import pytest
from golden.comparison import differences, moved
from golden.freeze import RUNS, frozen


@pytest.mark.study
@pytest.mark.parametrize("name", RUNS)
def test_a_scene_answers_what_it_answered(name, tmp_path):
    assert moved(name, frozen(name, tmp_path)) == []


def test_a_moved_number_is_found():
    before = {"K": 905.85, "n": 3, "passed": True}
    assert differences(before, dict(before), 1e-3, same=True) == []
    assert len(differences(before, before | {"K": 905.85 * (1 + 1e-8)}, 1e-3, same=True)) == 1
    assert differences(before, before | {"K": 905.85 * (1 + 5e-4)}, 1e-3, same=False) == []
    assert len(differences(before, before | {"K": 905.85 * (1 + 2e-3)}, 1e-3, same=False)) == 1
    assert len(differences(before, {"K": 905.85, "n": 4}, 1e-3, same=True)) == 2

"""The table of docs/accuracy.md on large strain, row by row."""

from dataclasses import replace
from pathlib import Path

import pytest

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.theory.deep_press import DeepPress
from cad.theory.soft_tissue import FLESH_LAWS
from cad.theory.two_spring_law import PAPER_SPRINGS
from pipeline.stages.contact import contact_compliance

PAGE = (Path(__file__).parents[2] / "docs" / "accuracy.md").read_text(encoding="utf-8")
DRIFT, READ = (0.06, 0.6), (0.1, 0.3, 0.6)


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.49])
def test_every_row_is_what_the_curves_give(poisson):
    K_m = contact_compliance(Fruit(poisson=poisson), Tips(), "split", 1e-3).K_m_over_E()  # at 1 MPa
    press = DeepPress(springs=PAPER_SPRINGS, side=1.0, poisson=poisson)
    for law in FLESH_LAWS:
        deep = replace(press, law=law)
        drift, *biases = (f"{100.0 * value:+.1f} %" for value in (deep.drift(K_m, DRIFT), *_biases(deep, K_m)))
        assert f"| {poisson:g} | {law} | 0 | {drift} | 0 | {' | '.join(biases)} |" in PAGE


def _biases(press: DeepPress, K_m: float) -> list[float]:
    return [press.bias(K_m, travel) for travel in READ]

"""What large strain does to the paper's press, beside the linear law: the table of docs/accuracy.md.

The factors are those of cad/theory/large_strain.toml; tests/docs/test_large_strain_table.py holds the page against it.
"""

from collections.abc import Iterator
from dataclasses import replace

from cad.design.fruit import Fruit
from cad.design.tips import Tips
from cad.theory.deep_press import DeepPress
from cad.theory.soft_tissue import FLESH_LAWS
from cad.theory.two_spring_law import PAPER_SPRINGS, force_ratio
from pipeline.response.contact import contact_compliance

POISSONS = (0.3, 0.4, 0.45, 0.49)
FIRST, TRAVELS = 0.06, (0.1, 0.3, 0.6)  # [mm]


def rows() -> Iterator[str]:
    """Yield a row for each Poisson's ratio and law: P at both ends of the travel, linear and large, and E at 1 MPa."""
    for poisson in POISSONS:
        K_m = contact_compliance(Fruit(poisson=poisson), Tips(), "split", 1e-3).K_m_over_E()
        linear = force_ratio(PAPER_SPRINGS, K_m)
        press = DeepPress(springs=PAPER_SPRINGS, side=1.0, poisson=poisson)
        for law in FLESH_LAWS:
            deep = replace(press, law=law)
            ratios = [f"{deep.ratio(K_m, travel):.3f}" for travel in (FIRST, TRAVELS[-1])]
            drift = f"{100.0 * deep.drift(K_m, (FIRST, TRAVELS[-1])):+.1f} %"
            biases = [f"{100.0 * deep.bias(K_m, travel):+.1f} %" for travel in TRAVELS]
            cells = [f"{poisson:g}", law, f"{linear:.3f}", *ratios, "0", drift, "0", *biases]
            yield f"| {' | '.join(cells)} |"

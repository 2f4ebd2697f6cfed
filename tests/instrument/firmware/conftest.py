"""The designs and units of stored presses, solved once."""

import pytest
from firmware_presses import FACTORS, UNITS
from measured_units import MeasuredDesign


@pytest.fixture(scope="session")
def designs(mango, paper, ball):
    """Return a function that returns a design by its name, solved once."""
    solved = {"mango": mango, "paper": paper, "ball": ball}

    def of(name):
        if name not in solved:
            path = "docs/examples/fouly.toml" if name == "line" else name
            solved[name] = MeasuredDesign(path, assessed=False)
        return solved[name]

    return of


@pytest.fixture(scope="session")
def unit_of(designs):
    """Return a function that returns the unit of a stored press."""

    def of(press):
        factors = FACTORS[press["design"]] if press["unit"] in ("stiffer", "higher") else 1.0
        return UNITS[press["unit"]](designs(press["design"]).measuring(factors))

    return of

"""What the tests of contact share."""

import pytest
from scenes import BLOCK

from sensor.design.tips import Tips
from solve.fruit.split import split_compliance


@pytest.fixture(scope="session")
def block_compliance():
    """Return the compliance of the paper's block under its pair of tips."""
    return split_compliance(BLOCK, Tips())

"""Commands make their solids in this process, and share what they solve."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def _work_here(kernel_here, curves_once):
    """Make solids in this process, and solve a force curve once."""

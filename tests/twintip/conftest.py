"""Commands make their solids in this process."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def _kernel_here(kernel_here):
    """Make solids in this process."""

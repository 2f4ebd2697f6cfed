"""What a refusal of bad input says."""

import pytest

from sensor.quantity import InputError


def refusal(work, *given, **more):
    """Return the error, of one line, by which work is refused."""
    with pytest.raises(InputError) as caught:
        work(*given, **more)
    assert "\n" not in str(caught.value)
    return caught.value

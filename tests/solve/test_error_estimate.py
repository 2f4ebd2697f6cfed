import pytest

from solve.error_estimate import propagate_errors


def test_propagated_errors():
    """Of a linear function they add as sizes of the slopes, of another one half the way between both ends counts."""
    values, errors = (2.0, -1.0, 4.0), (0.1, 0.2, 0.0)
    assert propagate_errors(lambda x, y, z: 3.0 * x - 5.0 * y + 7.0 * z, values, errors) == pytest.approx(1.3)
    assert propagate_errors(lambda x: x**3, (2.0,), (0.5,)) == pytest.approx(0.5 * (2.5**3 - 1.5**3))
    assert propagate_errors(lambda x: x, (1.0,), (0.0,)) == 0.0

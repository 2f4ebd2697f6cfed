"""The side on which the limit of a verdict bounds its value."""

from fnmatch import fnmatchcase

import pytest

from sensor.verdict import SENSES, at_least, equal, failed_verdict, one_sided


def test_sense_of_a_verdict_is_that_of_its_name():
    """A target has none, and a limit in words has no sign whatever the name."""
    assert at_least("geometry.frame_clearance", 0.2, 0.1, 0.0, unit="mm", reference="r").sense == "at least"
    assert failed_verdict("reading.bias", 0.05, unit="1", reference="r").limit_sense == "at most"
    assert failed_verdict("reading.bias", "tips with a dome", unit="1", reference="r").limit_sense is None
    assert equal("NL", 0.05, 0.05, 0.001, unit="1", reference="r").sense is None


@pytest.mark.parametrize("name", ["NL", "bruise"])
def test_maker_refuses_a_name_of_another_sense(name):
    """One that judges by "at least" takes no target and no name that is declared "at most"."""
    with pytest.raises(ValueError, match=name):
        at_least(name, 1.0, 0.5, 0.0, unit="1", reference="r")
    with pytest.raises(ValueError, match="at least"):
        one_sided(equal(name, 1.0, 1.0, 0.0, unit="1", reference="r"), "at least")


def test_no_name_matches_two_patterns():
    """The order of the table then decides nothing."""
    for name in (pattern.replace("*", "x") for pattern in SENSES):
        assert sum(fnmatchcase(name, pattern) for pattern in SENSES) == 1

"""The section Attributes says of each field what it declares, in the words of Python."""

import inspect
from dataclasses import dataclass

import pytest

from docs.docstrings import entries
from sensor.attributes import with_attributes
from sensor.quantity import Estimate, report_field


@with_attributes
@dataclass(frozen=True, kw_only=True)
class ReadingRequirements:
    """A reading.

    Examples
    --------
    >>> Reading
    """

    E: float | None = report_field("MPa", "modulus; null if [no tip](page.md#tips) touches", key="E_MPa")
    u: float = report_field("%", "half width. It holds 95 %", key="u_percent", times=100.0, attribute_unit="1")
    count: int = report_field("1", "number of samples")
    flags: tuple[str, ...] = report_field("", "flags")
    bars: dict[str, Estimate] = report_field("N", "bars by tip", key="`low_N`, `high_N`")


@pytest.mark.parametrize(
    ("name", "kind", "meaning"),
    [
        ("E", "float or None", "Modulus [MPa]; None if no tip touches. In JSON: `E_MPa`."),
        ("u", "float", "Half width [1]. It holds 95 %. In JSON: `u_percent`."),
        ("count", "int", "Number of samples."),
        ("flags", "tuple of str", "Flags."),
        ("bars", "dict of str to Estimate", "Bars by tip [N]. In JSON: `low_N`, `high_N`."),
    ],
)
def test_attribute_has_type_unit_and_meaning(name, kind, meaning):
    before, _, section = inspect.getdoc(ReadingRequirements).partition("\n\nAttributes\n----------\n")
    section, title, _ = section.partition("\n\nExamples\n--------\n")
    assert before == "A reading."
    assert title
    assert (name, kind, meaning) in [*entries(section)]


def test_record_without_docstring_stays_without_one():
    """As python -OO leaves docstrings out."""
    kind = dataclass(type("Bare", (), {"__annotations__": {"E": float}}))
    kind.__doc__ = None
    assert with_attributes(kind).__doc__ is None

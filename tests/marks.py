"""Cases of a test by how long they take: quick, slow, or a study."""

from collections.abc import Collection, Iterable

import pytest


def cases_by_time(names: Iterable[str], *, slow: Collection[str], studies: Collection[str]) -> list:
    """Return the names as parameters of a test, with the marks of those that are slow or a study."""
    return [pytest.param(name, marks=_marks(name, slow, studies)) for name in names]


def _marks(name: str, slow: Collection[str], studies: Collection[str]):
    if name in studies:
        return pytest.mark.study
    return pytest.mark.slow if name in slow else ()

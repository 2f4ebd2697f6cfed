"""The date of files: only the environment decides it, so that the same part gives the same bytes."""

import os
from datetime import UTC, datetime

from sensor.quantity import validation_error

NAME = "SOURCE_DATE_EPOCH"  # https://reproducible-builds.org/specs/source-date-epoch/
FIRST_DAY = 1577836800  # 2020-01-01, where it is not set
_LAST_SECOND = 253402300799  # of the year 9999


def given_date() -> datetime | None:
    """Return the date that SOURCE_DATE_EPOCH tells, None where it is not set; raises InputError for no time."""
    return file_date() if NAME in os.environ else None


def file_date() -> datetime:
    """Return the date of files: SOURCE_DATE_EPOCH [s since 1970], or a fixed day; raises InputError for no time."""
    text = os.environ.get(NAME, str(FIRST_DAY))
    digits = text.strip()
    if not (digits.isascii() and digits.isdecimal() and int(digits[:20]) <= _LAST_SECOND):
        raise validation_error(
            NAME, text, "s", f"a whole number from 0 to {_LAST_SECOND}", "unset it, or give seconds since 1970"
        )
    return datetime.fromtimestamp(int(digits), tz=UTC)

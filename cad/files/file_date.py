"""The date that is written to files: from the environment or fixed, so that identical parts give identical files."""

import os
from datetime import UTC, datetime

from sensor.quantity import validation_error

DATE_VARIABLE = "SOURCE_DATE_EPOCH"  # https://reproducible-builds.org/specs/source-date-epoch/
DEFAULT_DATE = 1577836800  # 2020-01-01, the date if the variable is not set
_LAST_SECOND = 253402300799  # the last second of the year 9999


def given_date() -> datetime | None:
    """Return the date in SOURCE_DATE_EPOCH, or None if it is not set.

    Raises InputError for an invalid value.
    """
    return file_date() if DATE_VARIABLE in os.environ else None


def file_date() -> datetime:
    """Return the date to write into exported files: SOURCE_DATE_EPOCH [s since 1970], or 2020-01-01 if it is not set.

    The date is not the present time, so that identical runs write identical files. Raises InputError for an invalid
    value.
    """
    text = os.environ.get(DATE_VARIABLE, str(DEFAULT_DATE))
    digits = text.strip()
    # Only the first 20 digits are compared with the limit, because Python refuses to convert very long numbers.
    if not (digits.isascii() and digits.isdecimal() and int(digits[:20]) <= _LAST_SECOND):
        raise validation_error(
            DATE_VARIABLE, text, "s", f"a whole number from 0 to {_LAST_SECOND}", "unset it, or give seconds since 1970"
        )
    return datetime.fromtimestamp(int(digits), tz=UTC)

"""Refuse `python -m pipeline`, which was removed, and name its replacement."""

import sys

from sensor.gone import refuse_removed
from sensor.quantity import InputError

if __name__ == "__main__":
    try:
        refuse_removed("python -m pipeline")
    except InputError as error:
        print(f"pipeline: {error}", file=sys.stderr)
        sys.exit(2)

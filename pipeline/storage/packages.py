"""Which packages the program needs, and in which version each is installed."""

import re
from importlib.metadata import PackageNotFoundError, requires, version

_NAME = re.compile(r"[A-Za-z0-9._-]+")


def declared_packages() -> tuple[str, ...]:
    """Return the names of the packages that every run needs; none where the program itself is not installed."""
    try:
        texts = requires("twintip") or []
    except PackageNotFoundError:
        return ()
    matches = (_NAME.match(text) for text in texts if "extra ==" not in text)
    return tuple(match[0] for match in matches if match)


def installed_version(name: str) -> str | None:
    """Return the version of a package, None where it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None

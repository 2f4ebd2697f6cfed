"""What a process may use: a run that may have too little does not start, a check may not take too much."""

import resource

from cad.quantity import validation_error

LEAST_MEMORY_GIB = 2.0  # resident; a run needs half of it
# A run maps 3.5 GiB of addresses where it may, and ends well with 3; its own data is 0.8 GiB.
_LEAST_GIB = (
    ("limit of address space (ulimit -v)", resource.RLIMIT_AS, 3.0),
    ("limit of data (ulimit -d)", resource.RLIMIT_DATA, 1.5),
)


def refuse_small_memory() -> None:
    """Raise InputError where the process may not take the memory that a run needs."""
    for name, kind, least in _LEAST_GIB:
        limit, _ = resource.getrlimit(kind)
        if limit != resource.RLIM_INFINITY and limit < least * 2**30:
            raise validation_error(
                name, round(limit / 2**30, 2), "GiB", f"at least {least:g} GiB", "lift it, for instance with unlimited"
            )


def lower_limit(kind: int, most: int) -> None:
    """Limit a resource of this process [unit of its kind], unless it is limited more already."""
    soft, hard = resource.getrlimit(kind)
    if soft == resource.RLIM_INFINITY or soft > most:
        resource.setrlimit(kind, (most, hard))

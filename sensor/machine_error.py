"""The error for a fault of the machine, which is never a verdict on a design."""


class MachineError(OSError):
    """A fault of this machine or of a library on it, which says nothing about the design, like any OSError."""

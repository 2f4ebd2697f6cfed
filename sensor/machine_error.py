"""The error for a fault of the machine, which is never an answer about a design."""


class MachineError(OSError):
    """A fault of this machine or of a library on it, as every other OSError: it says nothing about the design."""

"""The error for a fault of the machine, as opposed to a fault of the design."""


class MachineError(OSError):
    """A fault of this machine or of a library on it, such as too little memory, but not of the design."""

"""The CAD kernel, imported at its first use: what needs numbers alone never waits for it.

Its package loads a toolkit for pictures whole, which nothing here draws with. While the package is imported an empty
module has the toolkit's name. It is gone afterwards: who wants pictures imports the toolkit as ever, and CadQuery's own
functions for pictures work.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING

_TOOLKIT = "vtk"


def load_kernel() -> ModuleType:
    """Import the kernel and return it."""
    kept_out = _TOOLKIT not in sys.modules
    if kept_out:
        sys.modules[_TOOLKIT] = ModuleType(_TOOLKIT)
    try:
        import cadquery
    finally:
        if kept_out:
            del sys.modules[_TOOLKIT]
    return cadquery


class _Kernel(ModuleType):
    """The kernel's names, the kernel itself imported when the first of them is asked for."""

    def __getattr__(self, name: str) -> object:
        """Return a name of the kernel; names in double underscores are asked for by tools and load nothing."""
        if name.startswith("__"):
            raise AttributeError(name)
        found = getattr(load_kernel(), name)
        setattr(self, name, found)
        return found


if TYPE_CHECKING:
    import cadquery as cq
else:
    cq = _Kernel("cadquery")

__all__ = ["cq", "load_kernel"]

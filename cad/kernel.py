"""The CAD kernel, imported without the toolkit for pictures that its package loads whole and nothing here draws with.

While CadQuery is imported an empty module has the toolkit's name. It is gone afterwards: who wants pictures imports
the toolkit as ever, and CadQuery's own functions for pictures work.
"""

import sys
from types import ModuleType

_TOOLKIT = "vtk"
_kept_out = _TOOLKIT not in sys.modules
if _kept_out:
    sys.modules[_TOOLKIT] = ModuleType(_TOOLKIT)
try:
    import cadquery as cq
finally:
    if _kept_out:
        del sys.modules[_TOOLKIT]

__all__ = ["cq"]

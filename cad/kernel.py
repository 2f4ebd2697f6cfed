"""Loads the CAD kernel ahead of its use, without most of VTK, which nothing here asks for."""

import importlib
import sys
from types import ModuleType

_VTK = "vtk"
# Each of these imports all 140 modules of VTK to see whether there is any. CadQuery imports the few that it needs.
_ASK_FOR_VTK = ("OCP.IVtk", "OCP.IVtkOCC", "OCP.IVtkTools", "OCP.IVtkVTK")


def load_kernel() -> None:
    """Import all that draws, writes and checks a sensor; it takes as long as the contact and half the springs."""
    if _VTK not in sys.modules:
        sys.modules[_VTK] = ModuleType(_VTK)
        try:
            for name in _ASK_FOR_VTK:
                importlib.import_module(name)
        finally:
            del sys.modules[_VTK]
    importlib.import_module("cad.checks.sensor_checks")

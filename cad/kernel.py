"""Loads the CAD kernel, which takes a second: ahead of its use, without what nothing here needs, or for one solid."""

import gc
import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import NoReturn

from cad.parts.housing import Housing, PartSize

# Each of these imports all 140 modules of VTK to see whether there is any.
_ASK_FOR_VTK = ("OCP.IVtk", "OCP.IVtkOCC", "OCP.IVtkTools", "OCP.IVtkVTK")
# What CadQuery draws pictures, reads and writes DXF and places assemblies with, and trimesh searches, fits and loads.
_LEFT_OUT = (
    "PIL",
    "casadi",
    "ezdxf",
    "ezdxf.entities",
    "meshio",
    "scipy",
    "scipy.ndimage",
    "scipy.optimize",
    "scipy.sparse",
    "scipy.sparse.linalg",
    "scipy.spatial",
    "vtk",
    "vtkmodules.vtkCommonDataModel",
    "vtkmodules.vtkFiltersCore",
    "vtkmodules.vtkFiltersExtraction",
    "vtkmodules.vtkIOExport",
    "vtkmodules.vtkIOXML",
    "vtkmodules.vtkRenderingCore",
)


def load_kernel() -> None:
    """Import all that draws, writes and checks a sensor, in a process that does nothing else.

    What is imported stays to the end of the process. The garbage collector, which would search it again and again, is
    told so: a third of the processor time of these imports was its.
    """
    gc.disable()
    try:
        with _left_out():
            for name in (*_ASK_FOR_VTK, "cadquery", "trimesh"):
                importlib.import_module(name)
        importlib.import_module("cad.checks.sensor_checks")
    finally:
        gc.freeze()
        gc.enable()


def solid_size(housing: Housing) -> PartSize:
    """Return volume, surface and areas of named faces of the solid of a housing [mm]."""
    from cad.parts.housing_solid import housing_part  # a process that asks a worker for it needs no kernel

    return housing_part(housing).size


@contextmanager
def _left_out() -> Iterator[None]:
    """Let empty modules stand for those that are left out; who imports one afterwards gets the module itself."""
    absent = [name for name in _LEFT_OUT if name not in sys.modules]
    sys.modules.update({name: _StandIn(name) for name in absent})
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


class _StandIn(ModuleType):
    """A module, and whatever has a name in it: all can be imported, and none can be called."""

    def __getattr__(self, name: str) -> "_StandIn":
        if name.startswith("__"):
            raise AttributeError(name)
        return _StandIn(f"{self.__name__}.{name}")

    def __call__(self, *_: object, **__: object) -> NoReturn:
        msg = f"{self.__name__} is left out where the CAD kernel is loaded ahead; import CadQuery plainly for it"
        raise ImportError(msg)

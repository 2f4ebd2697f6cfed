"""A faster import of the CAD kernel, which takes a second: before it is needed, and without unneeded modules."""

import gc
import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import NoReturn

from cad.parts.housing import Housing, PartSize

# Each of these imports all 140 modules of VTK only to find out whether VTK is installed.
_ASK_FOR_VTK = ("OCP.IVtk", "OCP.IVtkOCC", "OCP.IVtkTools", "OCP.IVtkVTK")
# Modules that CadQuery needs only for pictures, DXF and constraints, or trimesh only for searches, fits and formats.
_UNNEEDED = (
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
    """Import all modules that draw, write and check a sensor, in a worker process that does nothing else.

    The garbage collector is paused during the imports, where it took a third of the CPU time. Later it never visits the
    imported objects, because they exist until the process ends.
    """
    gc.disable()
    try:
        with _replace_unneeded():
            for name in (*_ASK_FOR_VTK, "cadquery", "trimesh"):
                importlib.import_module(name)
        importlib.import_module("cad.checks.sensor_checks")
    finally:
        gc.freeze()
        gc.enable()


def solid_size(housing: Housing) -> PartSize:
    """Return the volume [mm^3], the surface and the areas of named faces [mm^2] of the solid of a housing."""
    from cad.parts.housing_solid import housing_part  # only the worker that runs this needs the kernel

    return housing_part(housing).size


@contextmanager
def _replace_unneeded() -> Iterator[None]:
    """Replace the modules of `_UNNEEDED` by stand-ins inside a `with` block; a later import loads the real module.

    Modules that are already imported are kept.
    """
    absent = [name for name in _UNNEEDED if name not in sys.modules]
    sys.modules.update({name: _StandIn(name) for name in absent})
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


class _StandIn(ModuleType):
    """A stand-in for a module and for every name in it, which can be imported but not called."""

    def __getattr__(self, name: str) -> "_StandIn":
        if name.startswith("__"):
            raise AttributeError(name)
        return _StandIn(f"{self.__name__}.{name}")

    def __call__(self, *_: object, **__: object) -> NoReturn:
        msg = f"{self.__name__} is a stand-in while the CAD kernel is loaded ahead; import CadQuery directly to use it"
        raise ImportError(msg)

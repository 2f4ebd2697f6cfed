"""A faster import of the CAD kernel, which takes a second.

The kernel is imported before it is needed, and without the modules that this project does not use.
"""

import gc
import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import NoReturn

from cad.parts.housing import Housing, PartSize

# Each of these would import all 140 modules of VTK, only to find out whether VTK is installed.
_MODULES_THAT_IMPORT_VTK = ("OCP.IVtk", "OCP.IVtkOCC", "OCP.IVtkTools", "OCP.IVtkVTK")
# CadQuery needs these modules only for pictures, DXF files and constraints. trimesh needs them only for searches, fits
# and other file formats.
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
    """Import the modules that draw a sensor, and write and check its main files, at the start of a worker process.

    The garbage collector is disabled during the imports, because it would take a third of their CPU time. Afterwards it
    ignores the imported objects, because they exist until the process ends. During the import of the kernel, modules
    that are not needed are replaced by stubs.
    """
    gc.disable()
    try:
        with _stub_unneeded_modules():
            for name in (*_MODULES_THAT_IMPORT_VTK, "cadquery", "trimesh"):
                importlib.import_module(name)
        # This module imports the others. The modules of drawings and fabrication files are imported when needed.
        importlib.import_module("cad.checks.sensor_checks")
    finally:
        gc.freeze()
        gc.enable()


def draw_part_size(housing: Housing) -> PartSize:
    """Draw the solid of a housing, and return its volume, its surface area and the areas of its named faces."""
    from cad.parts.housing_solid import housing_part  # loads the kernel, which only a worker process needs

    return housing_part(housing).size


@contextmanager
def _stub_unneeded_modules() -> Iterator[None]:
    """Replace the modules in `_UNNEEDED` by stubs inside a `with` block. A later import loads the real module.

    Modules that have already been imported are not replaced, because other modules may be using them.
    """
    stubbed = [name for name in _UNNEEDED if name not in sys.modules]
    sys.modules.update({name: _Stub(name) for name in stubbed})
    try:
        yield
    finally:
        for name in stubbed:
            del sys.modules[name]


class _Stub(ModuleType):
    """A substitute for a module and for every name in it. It can be imported, but not called."""

    def __getattr__(self, name: str) -> "_Stub":
        if name.startswith("__"):  # Python looks up such names itself, and must not get a stub
            raise AttributeError(name)
        return _Stub(f"{self.__name__}.{name}")

    def __call__(self, *_: object, **__: object) -> NoReturn:
        msg = (
            f"{self.__name__} cannot be called, because `load_kernel` has replaced it by a stub. "
            "Import CadQuery directly to use it."
        )
        raise ImportError(msg)

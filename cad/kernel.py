"""The CAD kernel and the library for triangles, imported at their first use: what needs numbers alone never waits.

The kernel's package loads whole what a sensor does not need: pictures and DXF files. While it is imported, stand-ins
have the names of the modules for these. A stand-in gives names that, at their first use, bring the modules and put what
is meant in their places, so CadQuery's functions work as ever. The stand-ins are gone after the import: who imports
such a module gets it, and one that was imported before is left alone.
"""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

_LATER = (
    "cadquery.occ_impl.exporters.dxf",
    "cadquery.occ_impl.exporters.vtk",
    "cadquery.occ_impl.importers.dxf",
    "OCP.IVtkOCC",
    "OCP.IVtkVTK",
    "vtkmodules.vtkCommonDataModel",
    "vtkmodules.vtkFiltersCore",
    "vtkmodules.vtkIOExport",
    "vtkmodules.vtkRenderingCore",
)


class _Name:
    """A name that is looked up in its module when it is called, asked for an attribute or taken for a class."""

    def __init__(self, module: str, name: str) -> None:
        self.place = module, name

    def meant(self) -> Any:  # noqa: ANN401 - a class or a function of another package
        """Return what the name is for; without a name the module."""
        module, name = self.place
        return getattr(import_module(module), name) if name else import_module(module)

    def __call__(self, *values: object, **named: object) -> object:
        return _in_place(self)(*values, **named)

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):  # typing asks an annotation for such names
            raise AttributeError(name)
        return getattr(_in_place(self), name)

    def __instancecheck__(self, thing: object) -> bool:
        return isinstance(thing, _in_place(self))

    def __mro_entries__(self, _bases: tuple[object, ...]) -> tuple[type, ...]:
        return (_in_place(self),)


def _in_place(name: _Name) -> Any:  # noqa: ANN401
    """Return what a name is for, once everything that names of stand-ins are for is in its place in CadQuery."""
    for module in [module for key, module in sys.modules.items() if key.partition(".")[0] == "cadquery"]:
        for key, value in list(vars(module).items()):
            if isinstance(value, _Name):
                setattr(module, key, value.meant())
    return name.meant()


class _StandIn(ModuleType):
    """A module of which every public name can be imported, and none is looked up yet."""

    def __getattr__(self, name: str) -> _Name:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Name(self.__name__, name)


@contextmanager
def _stand_ins() -> Iterator[None]:
    """Keep stand-ins among the modules while CadQuery is imported.

    The garbage collector waits meanwhile: nothing of what is brought can go, and it would look through it all, over
    and over.
    """
    if "cadquery" in sys.modules:
        yield
        return
    absent, collecting = [name for name in _LATER if name not in sys.modules], gc.isenabled()
    sys.modules.update({name: _StandIn(name) for name in absent})
    gc.disable()
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]
        if collecting:
            gc.enable()
    for package, _, last in (name.rpartition(".") for name in absent if name.startswith("cadquery")):
        vars(sys.modules[package]).setdefault(last, _Name(f"{package}.{last}", ""))


def load_kernel() -> ModuleType:
    """Import the kernel and return it."""
    with _stand_ins():
        import cadquery
    return cadquery


class _Late(ModuleType):
    """The names of a package that is imported when the first of them is asked for."""

    def __getattr__(self, name: str) -> object:
        """Return a name of the package; names in double underscores are asked for by tools and load nothing."""
        if name.startswith("__"):
            raise AttributeError(name)
        if self.__name__ in ("cadquery", "OCP"):
            load_kernel()
        found = getattr(import_module(self.__name__), name)
        setattr(self, name, found)
        return found


if TYPE_CHECKING:
    import cadquery as cq
    import OCP
    import trimesh
else:
    cq, OCP, trimesh = _Late("cadquery"), _Late("OCP"), _Late("trimesh")

__all__ = ["OCP", "cq", "load_kernel", "trimesh"]

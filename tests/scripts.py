"""Scripts that stand outside the packages, loaded as modules."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType


def loaded_script(path: Path) -> ModuleType:
    """Return a script as a module under its own file name; raises ImportError where it is none."""
    name = f"script_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # a dataclass looks its module up by this name
    spec.loader.exec_module(module)
    return module

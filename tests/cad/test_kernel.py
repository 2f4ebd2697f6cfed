"""A kernel that is loaded ahead does all the work of a worker, without the libraries that no task needs."""

import subprocess
import sys

LOADED = """
import gc, sys
from cad.kernel import load_kernel
load_kernel()
import cadquery as cq
assert gc.isenabled()
print(*sorted({name.partition(".")[0] for name in sys.modules}))
try:
    cq.Solid.makeBox(1.0, 1.0, 1.0).toVtkPolyData()
except ImportError as error:
    print(error)
import scipy.optimize
print(scipy.optimize.brentq(lambda x: x - 0.25, 0.0, 1.0))
"""
UNNEEDED = {"PIL", "casadi", "ezdxf", "meshio", "scipy", "vtk", "vtkmodules"}


def test_kernel_loads_no_library_that_no_task_needs_and_says_so_where_one_is_asked_for():
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    loaded, error, root = done.stdout.splitlines()
    assert {"OCP", "cadquery", "lib3mf", "shapely", "trimesh"} <= set(loaded.split())
    assert not UNNEEDED & set(loaded.split())
    assert error.startswith("vtkmodules.")
    assert float(root) == 0.25  # a module that was left out is the real one for who imports it afterwards

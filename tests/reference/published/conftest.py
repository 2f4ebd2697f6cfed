"""What the published problem sets share: isoparametric 20-node hexahedra and unit loads."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import ElementHex2, ElementHexS2, LinearForm, MeshHex, MeshHex2
from skfem.helpers import dot


@pytest.fixture(scope="session")
def serendipity():
    """Return a function that puts face and body nodes of a MeshHex2 where its corner and edge nodes say.

    MeshHex2 maps by 27 nodes; only with these in the span of the 20 is a 20-node displacement isoparametric.
    """

    def place(mesh):
        nodes = mesh.dofs.element_dofs
        doflocs = mesh.doflocs.copy()
        for row, at in zip(nodes[20:], ElementHex2.doflocs[20:], strict=True):
            N = np.array([ElementHexS2().lbasis(at[:, None], i)[0] for i in range(20)])[:, 0]
            doflocs[:, row] = np.einsum("n,dne->de", N, doflocs[:, nodes[:20]])
        return replace(mesh, doflocs=doflocs)

    return place


@pytest.fixture(scope="session")
def mapped_hexes(serendipity):
    """Return a function that maps a grid of the unit cube: corners and mid-sides by the map, curved where it curves."""

    def build(place, counts):
        lines = [np.linspace(0.0, 1.0, n + 1) for n in counts]
        cube = MeshHex2.from_mesh(MeshHex.init_tensor(*lines))
        ends = {f"{'xyz'[a]}={v}": (lambda x, a=a, v=v: np.abs(x[a] - v) < 1e-9) for a in range(3) for v in (0, 1)}
        named = cube.with_boundaries(ends)
        return serendipity(replace(named, doflocs=place(named.doflocs)))

    return build


@pytest.fixture(scope="session")
def face_load():
    """Return a function that assembles the load of a traction t(x) (3, ...) on a named face."""

    def load(basis, face, traction):
        form = LinearForm(lambda v, w: dot(traction(w.x), v))
        return form.assemble(basis.boundary(face))

    return load

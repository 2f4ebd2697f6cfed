"""Contact by other methods: twelve scenes by split and direct elements, partial contact, and a curved solid itself.

Run as a script from the root of the repository, one thread: `OMP_NUM_THREADS=1 python tests/bench/bench_contact.py`;
`--only NAME` picks one table. `pipeline bench` has the paper's block and the cost of tables, coverage.py random scenes.
"""

import argparse
import dataclasses
import sys
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from scripts import loaded_script  # noqa: E402

from cad.design.parameters import Fruit, Press, Tips  # noqa: E402
from cad.parts.fruit import curved_fruit  # noqa: E402
from mesh.fruit import fruit_size  # noqa: E402
from mesh.volume import volume_mesh  # noqa: E402
from pipeline.bench.contact import pair_and_own, relative_errors  # noqa: E402
from pipeline.bench.harness import timed  # noqa: E402
from pipeline.response.contact import contact_compliance  # noqa: E402
from solve.contact.response import scene_response  # noqa: E402
from solve.contact.scene import Scene  # noqa: E402
from solve.fruit.split import split_compliance  # noqa: E402

BLOCK, TIPS = Fruit(), Tips()
SPHERE = Fruit(shape="sphere", radius_mm=35.0, length_mm=20.0, width_mm=20.0)


TWELVE = {
    "paper": (BLOCK, TIPS),
    "paper, nu 0.45": (dataclasses.replace(BLOCK, poisson=0.45), TIPS),
    "20 x 12 plan, 20 high": (Fruit(width_mm=12.0, height_mm=20.0), TIPS),
    "the same, nu 0.45": (Fruit(width_mm=12.0, height_mm=20.0, poisson=0.45), TIPS),
    "cube of 12": (Fruit(length_mm=12.0, width_mm=12.0), TIPS),
    "3 high": (Fruit(height_mm=3.0), TIPS),
    "thin layer 2 high, nu 0.45": (Fruit(length_mm=16.0, width_mm=10.0, height_mm=2.0, poisson=0.45), TIPS),
    "as high as the side": (Fruit(length_mm=24.0, height_mm=2.0), Tips(side_mm=2.0, spacing_mm=8.0)),
    "1.5 sides from a side": (Fruit(length_mm=14.0, width_mm=8.0), Tips(offset_mm=1.0)),
    "off centre": (BLOCK, Tips(offset_mm=3.0)),
    "close, 1.5 sides": (BLOCK, Tips(spacing_mm=1.5)),
    "cylinders": (BLOCK, Tips(shape="cylinder")),
}


def twelve_scenes() -> None:
    """Print both methods on twelve scenes; they agree where |difference| is at most the sum of the bars."""
    print("\nSplit against direct finite elements, s11 - s12 [1/mm]")
    print(f"{'scene':>28} {'split':>10} {'direct':>10} {'difference %':>12} {'sum of bars %':>13} {'CPU s':>13}")
    worst = 0.0
    for name, (fruit, tips) in TWELVE.items():
        (split, one), (direct, other) = (
            timed(partial(contact_compliance, fruit, tips, method)) for method in ("split", "direct")
        )
        values = [pair_and_own(np.array(found.S))[0] for found in (split, direct)]
        change = 100.0 * (values[1] / values[0] - 1.0)
        bars = 100.0 * sum(relative_errors(found)[0] for found in (split, direct))
        worst = max(worst, abs(change) / bars)
        shown = f"{values[0]:10.6f} {values[1]:10.6f}"
        print(f"{name:>28} {shown} {change:12.3f} {bars:13.3f} {one:6.2f}/{other:5.1f}")
    print(f"largest difference over sum of bars: {worst:.2f}")


def independent() -> ModuleType:
    """Return the module of the independent computation, which the tests run on coarser meshes."""
    return loaded_script(ROOT / "tests" / "validation" / "test_partial_contact.py")


def partial_contact() -> None:
    """Print forces, areas and resultants of scenes with lift-off against nodal contact on direct finite elements."""
    check = independent()
    meshes = [check.condensed(scale) for scale in (2.0, 1.0, 0.5)]
    compliance = split_compliance(BLOCK, TIPS)
    print("\nPartial contact: split, nodal contact on three meshes, its limit; low and high tip; E 2 MPa")
    for name in check.SCENES:
        scene, x = check.split_scene(name)
        one = check.footprint_pressure(scene, compliance, check.SPRINGS, check.E, x)
        states = [check.nodal_contact(nodes, check.approach(nodes, *check.SCENES[name])) for nodes in meshes]
        limit, bar = check.extrapolated(meshes[1:], name, "forces")
        print(f"  {name}, x = {x:g} mm")
        print(f"    forces [N]   split {one.forces}  nodal {[s.forces for s in states]}  limit {limit} +- {bar}")
        off = np.divide(one.forces, limit, out=np.ones(2), where=limit > 0.0) - 1.0
        print(f"    difference % {100.0 * off}")
        print(f"    area [mm^2]  split {one.touching_mm2}  nodal {[s.areas for s in states]}")
        centre, spread = check.extrapolated(meshes[1:], name, "resultant")
        middle = 0.5 * (one.edges[1:] + one.edges[:-1])
        moment = np.einsum("tij,i->t", one.cell_forces, middle)
        found = np.divide(moment, one.forces, out=np.zeros(2), where=one.forces > 0.0)
        print(f"    resultant [mm] split {found}  limit {centre} +- {spread}")


def curved_solid() -> None:
    """Print what counting a sphere as a block leaves out: nodal contact on a mesh of the curved solid itself."""
    check = independent()
    meshes = [curved_nodes(check, scale) for scale in (2.0, 1.0)]
    compliance = split_compliance(BLOCK, TIPS)
    print("\nSphere of 35 mm: split on the equivalent block against nodal contact on the curved solid; E 2 MPa")
    print(f"{'tilt deg':>9} {'x mm':>5} {'F_l, F_h split':>18} {'limit, two meshes':>18} {'+-':>18} {'off %':>14}")
    for tilt in (0.0, 2.0):
        for x in (0.05, 0.1, 0.3, 0.6):
            scene = Scene(fruit=SPHERE, tips=TIPS, press=Press(tilt_deg=tilt))
            one = scene_response(scene, compliance, check.SPRINGS, (check.E,), [x]).responses[0]
            coarse, fine = (
                check.nodal_contact(nodes, x + nodes.places[:, 0] * np.tan(np.radians(tilt)) + height).forces
                for nodes, height in meshes
            )
            limit, bar = 2.0 * fine - coarse, check.BAR * np.abs(fine - coarse)
            found = np.array([one.F_l[0], one.F_h[0]])
            off = 100.0 * (np.divide(found, limit, out=np.ones(2), where=limit > 0.0) - 1.0)
            shown = " ".join(f"{pair[0]:9.4f} {pair[1]:8.4f}" for pair in (found, limit, bar))
            print(f"{tilt:9g} {x:5g} {shown} {off[0]:7.2f} {off[1]:6.2f}")


def curved_nodes(check: ModuleType, scale: float):
    """Return the nodes under the tips on a mesh of the curved solid, and their height over first touch [mm]."""
    part = curved_fruit(SPHERE, TIPS)
    mesh = volume_mesh(part, fruit_size(part, SPHERE, TIPS, scale), tolerance=6e-3)
    basis = check.vector_basis(mesh, check.ElementTetP2(), order=2)
    factor = check.factorised(check.stiffness_matrix(basis, 1.0, SPHERE.poisson), basis.get_dofs("base").all())
    under = [basis.get_dofs(name).all("u^3") for name in ("low_tip", "high_tip")]
    dofs = np.concatenate(under)
    compliance = np.empty((len(dofs), len(dofs)))
    for first in range(0, len(dofs), 100):
        chosen = dofs[first : first + 100]
        unit = np.zeros((basis.N, len(chosen)))
        unit[chosen, np.arange(len(chosen))] = 1.0
        compliance[:, first : first + 100] = factor.solve(unit)[dofs]
    tip = np.repeat([0, 1], [len(one) for one in under])
    # the independent computation counts the forces of a half twice: on the whole solid a node stands for half of one
    nodes = check.Nodes(basis.doflocs[:2, dofs].T, tip, 2.0 * compliance, np.ones(len(dofs)))
    inner = 0.5 * (TIPS.spacing_mm - TIPS.side_mm)
    return nodes, basis.doflocs[2, dofs] + SPHERE.fall_mm(inner, 0.0)


def main() -> None:
    """Print the tables asked for."""
    jobs = {"twelve": twelve_scenes, "partial": partial_contact, "curved": curved_solid}
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--only", choices=tuple(jobs))
    chosen = reader.parse_args()
    np.set_printoptions(precision=4, linewidth=160)
    for name, job in jobs.items():
        if chosen.only in (None, name):
            job()


if __name__ == "__main__":
    main()

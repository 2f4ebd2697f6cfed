"""Contact, speed against error: paper's block, twelve scenes two ways, random scenes, tables of travel and modulus.

Run as a script from the root of the repository, one thread: `OMP_NUM_THREADS=1 python tests/bench/bench_contact.py`;
`--scenes N` sets the number of random scenes, `--only NAME` picks one table. CPU seconds after imports.
"""

import argparse
import dataclasses
import importlib.util
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from cad.design.parameters import Fruit, Press, Tips  # noqa: E402
from cad.parts.curved_fruit import curved_fruit  # noqa: E402
from mesh.fruit import fruit_size  # noqa: E402
from mesh.volume import volume_mesh  # noqa: E402
from pipeline.stages.contact import contact_compliance  # noqa: E402
from solve.contact.response import scene_response  # noqa: E402
from solve.contact.scene import Scene  # noqa: E402
from solve.fruit.split import LEVELS, Foot, feet_compliance, split_compliance  # noqa: E402
from solve.halfspace.punch import square_punch  # noqa: E402

REFERENCE = (0.766603, 0.010526)  # two independent methods to 2e-6, see tests/solve/test_split.py
FINEST = LEVELS[1]  # 3 to 4 times closer than the first level on the paper's block
SPRINGS = np.diag([1.0 / 0.9057, 1.0 / 20.831])
E = 0.5 * np.arange(1, 8)
SEED = 5
BLOCK, TIPS = Fruit(), Tips()
SPHERE = Fruit(shape="sphere", radius_mm=35.0)


def paired(S):
    """Return the mean of s11 and s22 less s12."""
    return 0.5 * (S[0][0] + S[1][1]) - 0.5 * (S[0][1] + S[1][0])


def timed(job: Callable[[], object]):
    """Return the result of a job and its CPU seconds."""
    start = time.process_time()
    found = job()
    return found, time.process_time() - start


def paper_block() -> None:
    """Print error against CPU of the split on the paper's block; the cached punch tables are made beforehand."""
    print("\nPaper's block, 20 x 20 x 12 mm, nu 0.3, 1 mm squares 8 mm apart")
    print(f"{'mesh':>22} {'dofs':>6} {'s11 error':>10} {'s11-s12':>10} {'CPU s':>6}")
    for nodes in (2, 3, 4, 5, 9):
        square_punch(nodes)
    feet = (Foot(-4.0, 1.0), Foot(4.0, 1.0))
    s11, s12 = REFERENCE
    for name, grading in (("coarser partner", LEVELS[0].coarser()), *((f"level {k}", g) for k, g in enumerate(LEVELS))):
        found, seconds = min(
            (timed(lambda g=grading: feet_compliance(BLOCK, feet, g)) for _ in range(3)), key=lambda r: r[1]
        )
        S = found.S
        print(
            f"{name:>22} {found.dofs:6d} {S[0, 0] / s11 - 1:10.1e} {paired(S) / (s11 - s12) - 1:10.1e} {seconds:6.2f}"
        )
    found, seconds = timed(lambda: split_compliance(BLOCK, TIPS))
    bars = found.error_percent, found.s11_error_percent
    print(f"with its error bar: s11 - s12 to {bars[0]:.3f} %, s11 to {bars[1]:.3f} %, {seconds:.2f} s")


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
        split, one = timed(lambda f=fruit, t=tips: contact_compliance(f, t, "split"))
        direct, other = timed(lambda f=fruit, t=tips: contact_compliance(f, t, "direct"))
        change = 100.0 * (paired(direct.S) / paired(split.S) - 1.0)
        bars = split.error_percent + direct.error_percent
        worst = max(worst, abs(change) / bars)
        values = f"{paired(split.S):10.6f} {paired(direct.S):10.6f}"
        print(f"{name:>28} {values} {change:12.3f} {bars:13.3f} {one:6.2f}/{other:5.1f}")
    print(f"largest difference over sum of bars: {worst:.2f}")


def random_scene(rng: np.random.Generator) -> tuple[Fruit, Tips]:
    """Return a scene in the domain of the split: sides 0.5 to 8 mm, heights 3 to 80 mm, nu to 0.4999."""
    while True:
        side = float(np.exp(rng.uniform(np.log(0.5), np.log(8.0))))
        spacing = side * float(np.exp(rng.uniform(np.log(1.2), np.log(12.0))))
        height = float(np.exp(rng.uniform(np.log(max(3.0, side)), np.log(80.0))))
        poisson = float(rng.choice([rng.uniform(0.0, 0.45), rng.uniform(0.45, 0.4999)]))
        offset = float(rng.choice([0.0, rng.normal(0.0, side)]))
        gaps = side * np.exp(rng.uniform(np.log(1.5), np.log(10.0), 2))
        length, width = spacing + side + 2.0 * abs(offset) + 2.0 * gaps[0], side + 2.0 * gaps[1]
        if max(length, width, height) < 25.0 * side and max(length, width) < 1000.0:
            fruit = Fruit(length_mm=length, width_mm=width, height_mm=height, poisson=poisson)
            return fruit, Tips(side_mm=side, spacing_mm=spacing, offset_mm=offset)


def random_scenes(count: int) -> None:
    """Print how often the error bar covers the difference to the next level, and the costs."""
    rng = np.random.default_rng(SEED)
    ratios, errors, bars, costs = [], [], [], []
    for _ in range(count):
        fruit, tips = random_scene(rng)
        found, seconds = timed(lambda f=fruit, t=tips: split_compliance(f, t))
        feet = tuple(Foot(tips.offset_mm + sign * 0.5 * tips.spacing_mm, tips.side_mm) for sign in (-1.0, 1.0))
        true = paired(feet_compliance(fruit, feet, FINEST).S)
        errors.append(100.0 * abs(paired(found.S) / true - 1.0))
        bars.append(found.error_percent)
        ratios.append(errors[-1] / bars[-1])
        costs.append(seconds)
    ratio = np.array(ratios)
    print(f"\n{count} random scenes in the domain of the split (seed {SEED}), against the next level")
    print(f"covered {np.mean(ratio <= 1.0):.3f}, largest error over bar {ratio.max():.2f}")
    print(f"error %: median {np.median(errors):.4f}, 95 % {np.quantile(errors, 0.95):.4f}, largest {max(errors):.4f}")
    print(f"bar %:   median {np.median(bars):.4f}, 95 % {np.quantile(bars, 0.95):.4f}, largest {max(bars):.4f}")
    most = f"95 % {np.quantile(costs, 0.95):.2f}, largest {max(costs):.2f}"
    print(f"CPU s with the bar: median {np.median(costs):.2f}, {most}")


TABLES = {
    "flat": Scene(fruit=BLOCK, tips=TIPS, press=Press()),
    "tilt 1": Scene(fruit=BLOCK, tips=TIPS, press=Press(tilt_deg=1.0)),
    "tilt 5": Scene(fruit=BLOCK, tips=TIPS, press=Press(tilt_deg=5.0)),
    "roll 3": Scene(fruit=BLOCK, tips=TIPS, press=Press(roll_deg=3.0)),
    "sphere 35 mm": Scene(fruit=SPHERE, tips=TIPS, press=Press()),
    "sphere, tilt 2, roll 1": Scene(fruit=SPHERE, tips=TIPS, press=Press(tilt_deg=2.0, roll_deg=1.0)),
    "fillet 0.1": Scene(fruit=BLOCK, tips=Tips(fillet_mm=0.1), press=Press()),
    "cylinder, tilt 2": Scene(fruit=BLOCK, tips=Tips(shape="cylinder"), press=Press(tilt_deg=2.0)),
    "spherical tips": Scene(fruit=BLOCK, tips=Tips(shape="sphere"), press=Press()),
}


def tables() -> None:
    """Print CPU and error bars of a table of 7 moduli and 13 travels, after the compliance; no cells are kept."""
    import solve.contact.cells
    import solve.contact.scene

    print("\n7 moduli x 13 travels after the compliance")
    print(
        f"{'scene':>24} {'cells':>6} {'CPU s':>8} {'P at 3.5 MPa: first, half, full':>34} {'bar % median, largest':>22}"
    )
    x = 0.6 * np.arange(1, 14) / 13
    for name, scene in TABLES.items():
        compliance = contact_compliance(scene.fruit, scene.tips)
        solve.contact.scene._footprints.cache_clear()
        solve.contact.cells._smooth_compliance.cache_clear()
        found, seconds = timed(lambda s=scene, c=compliance: scene_response(s, c, SPRINGS, tuple(E), x))
        P = found.responses[-1].P[[0, 6, 12]]
        bar = found.P_error_percent[np.isfinite(found.P_error_percent)]
        shown = " ".join(f"{value:10.4f}" for value in P)
        print(f"{name:>24} {found.cells:6d} {seconds:8.3f} {shown:>34} {np.median(bar):11.3f} {bar.max():10.3f}")


def independent() -> ModuleType:
    """Return the module of the independent computation, which the tests run on coarser meshes."""
    path = ROOT / "tests" / "validation" / "test_partial_contact.py"
    spec = importlib.util.spec_from_file_location("partial_contact", path)
    if spec is None or spec.loader is None:
        raise ImportError(path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


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
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--scenes", type=int, default=200)
    reader.add_argument("--only", choices=("paper", "twelve", "random", "tables", "partial", "curved"))
    chosen = reader.parse_args()
    jobs = {
        "paper": paper_block,
        "tables": tables,
        "random": lambda: random_scenes(chosen.scenes),
        "twelve": twelve_scenes,
        "partial": partial_contact,
        "curved": curved_solid,
    }
    np.set_printoptions(precision=4, linewidth=160)
    for name, job in jobs.items():
        if chosen.only in (None, name):
            job()


if __name__ == "__main__":
    main()

"""What a skin bonded on the flesh changes in the compliance of the fruit, at each modulus of the flesh.

As in `solve/fruit/curved_body.py`, one mesh answers smooth loads with and without the skin: what is left of its error
is small, for the sharp part of the change is that of a half-space (`solve/halfspace/layered.py`). With m the modulus of
the skin over that of the flesh, the stiffness of the mesh is K + m K_skin: solutions at a few m span those at all of
them, and the compliance, an energy, is off by the square of what the span misses (Galerkin). Times E throughout.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.theory.sloped_skin import slope_factor, stretch_factor
from solve.elasticity import stiffness_matrix
from solve.fruit.bent_block import bent_block, core_of
from solve.fruit.body_lines import BodySteps
from solve.fruit.compliance import FruitCompliance, SkinTable
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.footprints import Footprint, level_compliance
from solve.fruit.smooth_load import SmoothLoad, least_deviation, smooth_loads
from solve.fruit.split import largest_errors, relative_changes
from solve.halfspace.layered import Layer, added_compliances, round_contact
from solve.halfspace.punch import circle_punch
from solve.linear import factorise

FINE = BodySteps(most_dofs=6000)
COARSE = BodySteps(fraction=0.7, most_dofs=3500)
# Finer meshes of pair and square leave 0.03 to 0.1 of the step between both; the floor is what wider loads move.
SAFETY = 0.15
FLOOR = 2e-4
# Deviation of a smooth load: as much of the depth, and so many least ones, for what bounds the fruit is to feel a load
# as it feels the tip.
OF_DEPTH = 0.125
WIDEST = 4.6
SPAN = (3, 2)  # moduli of the skin whose solutions span all, on the fine and on the coarse mesh
MODULI = 13  # of the table
BEYOND = 1.3  # of the largest modulus, and under the least one, that the table holds
SOFTEST = 1.0 / 24.0  # of E_max: the second point of a curve of P
# Nodes a side that carry the pressure of a tip under a skin, from this thickness [sides] up.
NODES = ((0.3, 9), (0.1, 17), (0.0, 25))
OF_NODES = 0.1  # of the step from half as many
OF_ARCHING = 0.5  # of what the skin bears as a shell: solids leave 0.3 of it. tests/solve/fruit/test_skin.py
ROUND_NODES = 9  # of a circle, whose own compliance has a closed equation


def table_moduli(fruit: Fruit) -> Floats:
    """Return the moduli of the flesh [MPa] at which the compliance under a skin is solved, (n,)."""
    least = min(*fruit.E_MPa, fruit.E_max_MPa) / BEYOND
    largest = max(*fruit.E_MPa, fruit.E_max_MPa) * BEYOND
    return np.geomspace(min(least, SOFTEST * fruit.E_max_MPa), largest, MODULI)


def layer_on(fruit: Fruit, E: float) -> Layer:
    """Return the skin of a fruit that has one, on flesh of modulus E [MPa]."""
    poisson = fruit.poisson if fruit.skin_poisson is None else fruit.skin_poisson
    return Layer(fruit.skin_mm or 0.0, (fruit.skin_E_MPa or E) / E, poisson, fruit.poisson)


def skin_compliance(
    bare: FruitCompliance, fruit: Fruit, footprints: Sequence[Footprint], along_normals: bool = False
) -> FruitCompliance:
    """Return the compliance [1/mm] of a fruit with its skin, given that of its flesh alone under the same footprints.

    `along_normals` says that the tips press along the normals of the skin, as domes do. Raises SolveError when a solve
    is not exact.
    """
    start = time.perf_counter()
    moduli = table_moduli(fruit)
    layers = [layer_on(fruit, E) for E in moduli.tolist()]
    least = least_deviation(footprints[0])
    loads = smooth_loads(fruit, footprints, min(WIDEST, max(1.0, OF_DEPTH * fruit.depth_mm / least)))
    per_side = next(nodes for least, nodes in NODES if layers[0].thickness >= least * footprints[0].side)
    if footprints[0].punch is circle_punch:
        per_side = ROUND_NODES
    sharp = layered_change(footprints, layers, per_side)
    fewer = layered_change(footprints, layers, (per_side + 1) // 2)
    smooth = smooth_change(loads, layers)
    arching = np.zeros_like(sharp)
    if fruit.radius_mm is not None:
        shape = CurvedShape(fruit, core_of(loads))
        curvatures = [1.0 / radius for radius in fruit.radii_mm]
        for tip, (footprint, load) in enumerate(zip(footprints, loads, strict=True)):
            as_stiff = 0.5 * footprint.side * footprint.punch(per_side).flat_stiffness  # radius of that circle
            arching[:, tip, tip] = [layer.arching(as_stiff, load.deviation, curvatures) for layer in layers]
            slope = shape.slope(footprint.x, footprint.y)
            if along_normals:  # round along the skin, where the smooth load is round as seen from above
                smooth[:, tip, tip] *= stretch_factor(slope)
            else:
                sharp[:, tip, tip] *= slope_factor(fruit.poisson, slope)
                smooth[:, tip, tip] *= slope_factor(fruit.poisson, slope)
    fine, dofs = body_change(fruit, footprints, loads, layers, FINE, SPAN[0], along_normals)
    coarse, _ = body_change(fruit, footprints, loads, layers, COARSE, SPAN[1], along_normals)

    table = bare.S + fine + sharp - smooth - arching
    errors = []
    asked = moduli >= min(fruit.E_MPa) / BEYOND * (1.0 - 1e-9)  # softer flesh only begins a curve
    parts = zip(table[asked], (fine - coarse)[asked], (sharp - fewer)[asked], arching[asked], strict=True)
    for S, step, of_nodes, arched in parts:
        changes = FLOOR + SAFETY * relative_changes(step, S) + OF_NODES * relative_changes(of_nodes, S)
        errors.append(largest_errors(changes + OF_ARCHING * relative_changes(arched, S), len(S)))
    skin = SkinTable(E=moduli, S=table)
    status = f"{bare.info.status}; under a skin by layered half-space and a mesh of {dofs} dofs with and without it"
    seconds = bare.info.seconds + time.perf_counter() - start
    return replace(
        bare,
        skin=skin,
        error_pair=bare.error_pair + max(error.pair for error in errors),
        error_own=bare.error_own + max(error.own for error in errors),
        info=replace(bare.info, method=f"{bare.info.method}, under a skin", seconds=seconds, status=status),
    )


def layered_change(footprints: Sequence[Footprint], layers: Sequence[Layer], per_side: int) -> Floats:
    """Return the change of compliance by layers under level footprints of a half-space [1/mm], (layers, tips, tips).

    Raises SolveError on a large residual.
    """
    nodes = np.concatenate([footprint.nodes(per_side) for footprint in footprints])
    x, y = nodes.T
    added = added_compliances(layers, np.hypot(x[:, None] - x, y[:, None] - y))
    bare = level_compliance(footprints, layers[0].poisson_below, np.zeros(()), per_side)
    changes = []
    for layer, between in zip(layers, added, strict=True):
        S = level_compliance(footprints, layer.poisson, layer.modulus * between, per_side) / layer.modulus
        change = S - bare
        for tip, footprint in enumerate(footprints):
            if footprint.punch is circle_punch:
                radius = 0.5 * footprint.side
                own = 1.0 / round_contact(layer, radius).flat_stiffness(radius)
                change[tip, tip] = own - (1.0 - layer.poisson_below**2) / footprint.side
        changes.append(change)
    return np.array(changes)


def smooth_change(loads: Sequence[SmoothLoad], layers: Sequence[Layer]) -> Floats:
    """Return the change of compliance by layers under smooth loads on a half-space [1/mm], (layers, loads, loads)."""
    bare = Layer(layers[0].thickness, 1.0, layers[0].poisson_below, layers[0].poisson_below)
    S = np.empty((len(layers) + 1, len(loads), len(loads)))
    for number, layer in enumerate((*layers, bare)):
        for i, felt in enumerate(loads):
            for j, load in enumerate(loads):
                distance = float(np.hypot(felt.x - load.x, felt.y - load.y))
                S[number, i, j] = layer.smooth_compliance((felt.deviation, load.deviation), distance)
    return np.asarray(S[:-1] - S[-1])


def body_change(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    layers: Sequence[Layer],
    steps: BodySteps,
    solves: int,
    along_normals: bool,
) -> tuple[Floats, int]:
    """Return the change of compliance by the skin under smooth loads on one mesh [1/mm], and its dofs.

    The change is (layers, loads, loads); `solves` moduli of the skin span all. Raises SolveError when a solve is
    not exact.
    """
    body = bent_block(fruit, footprints, loads, steps, along_normals)
    in_skin = (body.flat.mesh.p[2, body.flat.mesh.t].mean(axis=0) < layers[0].thickness).astype(np.float64)
    flesh = stiffness_matrix(body.bent, 1.0 - in_skin, fruit.poisson, b_bar=True)
    skin = stiffness_matrix(body.bent, in_skin, layers[0].poisson, b_bar=True)
    without = flesh + stiffness_matrix(body.bent, in_skin, fruit.poisson, b_bar=True)
    moduli = np.array([layer.modulus for layer in layers])
    span = np.geomspace(moduli.min(), moduli.max(), solves)

    change = np.zeros((len(layers), len(loads), len(loads)))
    for parity in body.parities:
        forces = body.forces(parity, body.normals)
        fixed = body.fixed_dofs(parity)
        bare = forces.T @ factorise(without, fixed).solve(forces)
        solved = [factorise(flesh + modulus * skin, fixed).solve(forces) for modulus in span]
        spanning, _ = np.linalg.qr(np.hstack(solved))
        load = spanning.T @ forces
        of_flesh = spanning.T @ (flesh @ spanning)
        of_skin = spanning.T @ (skin @ spanning)
        for i, modulus in enumerate(moduli):
            energy = load.T @ np.linalg.solve(of_flesh + modulus * of_skin, load)
            change[i] += (energy - bare) / 2.0 ** np.abs(parity).sum()
    return change, int(body.flat.N)

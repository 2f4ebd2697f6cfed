"""What a skin bonded on the flesh changes in the compliance of the fruit, at each modulus of the flesh.

As in `solve/fruit/curved_body.py`, one mesh answers smooth loads with and without the skin. What is left of its error
is small, for the sharp part of the change is that of a half-space (`solve/halfspace/layered.py`). With m the modulus of
the skin over that of the flesh, the stiffness of the mesh is K + m K_skin. Solutions at a few m span those at all of
them. The compliance, an energy, is off by the square of what the span misses (Galerkin). Times E throughout.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from sensor.theory.sloped_skin import slope_factor, stretch_factor
from solve.elasticity import stiffness_matrix
from solve.fruit.bent_block import BentBlock, bent_block, core_of
from solve.fruit.body_lines import BodySteps
from solve.fruit.compliance import FruitCompliance, SkinTable
from solve.fruit.curved_shape import CurvedShape
from solve.fruit.footprints import Footprint, level_compliance
from solve.fruit.smooth_load import SmoothLoad, least_deviation, smooth_loads
from solve.fruit.split import Errors, largest_errors, relative_changes
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
OF_SHELL = 0.5  # of what the skin bears as a shell: solids leave 0.3 of it. tests/solve/fruit/test_skin.py
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

    At each modulus of the flesh a mesh gives the change under smooth loads. The half-space gives that under the tips
    less that under the smooth loads. `along_normals` says that the tips press along the normals of the skin, as domes
    do. Raises SolveError when a solve is not exact.
    """
    start = time.perf_counter()
    moduli = table_moduli(fruit)
    layers = [layer_on(fruit, E) for E in moduli.tolist()]
    least = least_deviation(footprints[0])
    loads = smooth_loads(fruit, footprints, min(WIDEST, max(1.0, OF_DEPTH * fruit.depth_mm / least)))
    local = _local_change(fruit, footprints, loads, layers, along_normals)
    fine_body = bent_block(fruit, footprints, loads, FINE, along_normals)
    coarse_body = bent_block(fruit, footprints, loads, COARSE, along_normals)
    fine = body_change(fine_body, layers, SPAN[0])
    coarse = body_change(coarse_body, layers, SPAN[1])

    # The change of the mesh, with the half-space's part under smooth loads exchanged for that under the tips.
    table = bare.S + fine + local.sharp - local.smooth - local.shell
    asked = moduli >= min(fruit.E_MPa) / BEYOND * (1.0 - 1e-9)  # softer flesh only begins a curve
    errors = _table_errors(table, fine - coarse, local, np.flatnonzero(asked))
    skin = SkinTable(E=moduli, S=table)
    dofs = int(fine_body.flat.N)
    status = f"{bare.info.status}; under a skin by layered half-space and a mesh of {dofs} dofs with and without it"
    seconds = bare.info.seconds + time.perf_counter() - start
    return replace(
        bare,
        skin=skin,
        error_pair=bare.error_pair + errors.pair,
        error_own=bare.error_own + errors.own,
        info=replace(bare.info, method=f"{bare.info.method}, under a skin", seconds=seconds, status=status),
    )


@dataclass(frozen=True, eq=False)
class _LocalChange:
    """Changes of compliance by layers that a half-space tells, times E [1/mm], each (layers, tips, tips).

    `sharp` is the change under rigid tips, `fewer_nodes` the same from half as many nodes. `smooth` is the change under
    the smooth loads. `shell` is what a curved skin bears as a shell, 0 on a block.
    """

    sharp: Floats
    fewer_nodes: Floats
    smooth: Floats
    shell: Floats


def _local_change(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    layers: Sequence[Layer],
    along_normals: bool,
) -> _LocalChange:
    """Return the changes on a half-space as curved as the fruit under each tip; raises as `layered_change`."""
    thickness = layers[0].thickness
    per_side = next(nodes for least, nodes in NODES if thickness >= least * footprints[0].side)
    if footprints[0].punch is circle_punch:
        per_side = ROUND_NODES
    sharp = layered_change(footprints, layers, per_side)
    fewer_nodes = layered_change(footprints, layers, (per_side + 1) // 2)
    smooth = smooth_change(loads, layers)
    shell = np.zeros_like(sharp)
    if fruit.radius_mm is not None:
        shape = CurvedShape(fruit, core_of(loads))
        curvatures = [1.0 / radius for radius in fruit.radii_mm]
        for tip, (footprint, load) in enumerate(zip(footprints, loads, strict=True)):
            # radius of the circle that is as stiff as the tip
            radius = 0.5 * footprint.side * footprint.punch(per_side).flat_stiffness
            shell[:, tip, tip] = [layer.shell_effect(radius, load.deviation, curvatures) for layer in layers]
            slope = shape.slope(footprint.x, footprint.y)
            if along_normals:  # round along the skin, where the smooth load is round as seen from above
                smooth[:, tip, tip] *= stretch_factor(slope)
            else:
                sharp[:, tip, tip] *= slope_factor(fruit.poisson, slope)
                smooth[:, tip, tip] *= slope_factor(fruit.poisson, slope)
    return _LocalChange(sharp=sharp, fewer_nodes=fewer_nodes, smooth=smooth, shell=shell)


def _table_errors(table: Floats, mesh_steps: Floats, local: _LocalChange, rows: Ints) -> Errors:
    """Return the largest relative errors [1] over some rows of a table (moduli, tips, tips) [1/mm].

    They add up a floor and three fractions: of the steps between two meshes, of the step between numbers of nodes, and
    of what the skin bears.
    """
    node_steps = local.sharp - local.fewer_nodes
    pair = own = 0.0
    for row in rows:
        S = table[row]
        mesh = SAFETY * relative_changes(mesh_steps[row], S)
        nodes = OF_NODES * relative_changes(node_steps[row], S)
        shell = OF_SHELL * relative_changes(local.shell[row], S)
        errors = largest_errors(FLOOR + mesh + nodes + shell, len(S))
        pair = max(pair, errors.pair)
        own = max(own, errors.own)
    return Errors(pair, own)


def layered_change(footprints: Sequence[Footprint], layers: Sequence[Layer], per_side: int) -> Floats:
    """Return the change of compliance by layers under level footprints of a half-space [1/mm], (layers, tips, tips).

    It is times the modulus below. Pressure stands on `per_side` nodes a side. Raises SolveError on a large residual.
    """
    nodes = np.concatenate([footprint.nodes(per_side) for footprint in footprints])
    x, y = nodes.T
    added = added_compliances(layers, np.hypot(x[:, None] - x, y[:, None] - y))
    bare = level_compliance(footprints, layers[0].poisson_below, np.zeros(()), per_side)
    changes = []
    for layer, between in zip(layers, added, strict=True):
        # Solved as a half-space of the layer, times its own modulus, to which `between` adds what lies below.
        S = level_compliance(footprints, layer.poisson, layer.modulus * between, per_side) / layer.modulus
        change = S - bare
        for tip, footprint in enumerate(footprints):
            if footprint.punch is circle_punch:  # whose own compliance has a closed equation
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


def body_change(body: BentBlock, layers: Sequence[Layer], solves: int) -> Floats:
    """Return the change of compliance by the skin under the loads of a body on its mesh, times E [1/mm].

    It has shape (layers, loads, loads). The fields at so many moduli of the skin as `solves` span those at all others.
    Raises SolveError when a solve is not exact.
    """
    poisson = layers[0].poisson_below
    in_skin = (body.flat.mesh.p[2, body.flat.mesh.t].mean(axis=0) < layers[0].thickness).astype(np.float64)
    flesh = stiffness_matrix(body.bent, 1.0 - in_skin, poisson, b_bar=True)
    skin = stiffness_matrix(body.bent, in_skin, layers[0].poisson, b_bar=True)
    without_skin = flesh + stiffness_matrix(body.bent, in_skin, poisson, b_bar=True)
    moduli = np.array([layer.modulus for layer in layers])
    span = np.geomspace(moduli.min(), moduli.max(), solves)

    count = len(body.loads)
    change = np.zeros((len(layers), count, count))
    for parity in body.parities:
        forces = body.forces(parity, body.normals)
        fixed = body.fixed_dofs(parity)
        bare = forces.T @ factorise(without_skin, fixed).solve(forces)
        # Galerkin's method on an orthonormal basis of the fields at the moduli of the span.
        solved = [factorise(flesh + modulus * skin, fixed).solve(forces) for modulus in span]
        spanning, _ = np.linalg.qr(np.hstack(solved))
        load = spanning.T @ forces
        of_flesh = spanning.T @ (flesh @ spanning)
        of_skin = spanning.T @ (skin @ spanning)
        for i, modulus in enumerate(moduli):
            energy = load.T @ np.linalg.solve(of_flesh + modulus * of_skin, load)
            # A single load is the mean of its parities: halved for each mirror plane.
            change[i] += (energy - bare) / 2.0 ** np.abs(parity).sum()
    return change

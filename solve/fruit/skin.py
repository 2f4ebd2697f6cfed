"""The change of the fruit's compliance by a skin bonded to the flesh, at each modulus of the flesh.

As in `solve/fruit/curved_body.py`, one mesh is solved under smooth loads with and without the skin. The remaining error
is small, because the sharp part of the change is the change of a half-space (`solve/halfspace/layered.py`). With m the
modulus of the skin over the modulus of the flesh, the stiffness of the mesh is K + m K_skin. Solutions at a few m span
the solutions at all m. The compliance is an energy, so its error is the square of the error of the solutions in the
span (Galerkin). All compliances are times E.
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
# Error over the step between both meshes; finer meshes of pair and square give 0.03 to 0.1. FLOOR is the relative
# change by wider loads.
SAFETY = 0.15
FLOOR = 2e-4
# Largest deviation of a smooth load, over the depth and over its least deviation. A wider load would act on the
# boundary of the fruit unlike the tip.
OF_DEPTH = 0.125
WIDEST = 4.6
SPAN = (3, 2)  # number of moduli of the skin whose solutions span all, on the fine and on the coarse mesh
MODULI = 13  # moduli of the table
BEYOND = 1.3  # factor by which the table extends beyond the largest modulus and below the least one
SOFTEST = 1.0 / 24.0  # modulus of the second point of a curve of P, over E_max
# Nodes per side for the pressure of a tip on a skin, from this thickness [sides] up.
NODES = ((0.3, 9), (0.1, 17), (0.0, 25))
OF_NODES = 0.1  # error over the step from half as many nodes
OF_SHELL = 0.5  # error over the stiffening as a shell; solids give 0.3. tests/solve/fruit/test_skin.py
ROUND_NODES = 9  # nodes per side of a circle, whose own compliance has a closed equation


def table_moduli(fruit: Fruit) -> Floats:
    """Return the moduli of the flesh [MPa] at which the compliance under a skin is solved, (n,)."""
    least = min(*fruit.E_MPa, fruit.E_max_MPa) / BEYOND
    largest = max(*fruit.E_MPa, fruit.E_max_MPa) * BEYOND
    return np.geomspace(min(least, SOFTEST * fruit.E_max_MPa), largest, MODULI)


def layer_on(fruit: Fruit, E: float) -> Layer:
    """Return the skin of a fruit as a layer on flesh of modulus E [MPa]."""
    poisson = fruit.poisson if fruit.skin_poisson is None else fruit.skin_poisson
    return Layer(fruit.skin_mm or 0.0, (fruit.skin_E_MPa or E) / E, poisson, fruit.poisson)


def skin_compliance(
    bare: FruitCompliance, fruit: Fruit, footprints: Sequence[Footprint], along_normals: bool = False
) -> FruitCompliance:
    """Return the compliance [1/mm] of a fruit with its skin, given the compliance `bare` without it.

    At each modulus of the flesh, a mesh gives the change under smooth loads. The half-space gives the change under the
    tips less the change under the smooth loads. With `along_normals`, the tips press along the normals of the skin, as
    domes do. Raises SolveError if a solve does not converge.
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

    # The change of the mesh, with the change of a half-space under smooth loads replaced by the change under the tips.
    table = bare.S + fine + local.sharp - local.smooth - local.shell
    wanted = moduli >= min(fruit.E_MPa) / BEYOND * (1.0 - 1e-9)  # softer flesh occurs only at the start of a curve of P
    errors = _table_errors(table, fine - coarse, local, np.flatnonzero(wanted))
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
    """Changes of compliance by layers on a half-space, times E [1/mm], each (layers, tips, tips).

    `sharp` is the change under rigid tips, `fewer_nodes` the same with half as many nodes. `smooth` is the change under
    the smooth loads. `shell` is the change by the stiffness of a curved skin as a shell, 0 on a block.
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
    """Return the changes on a half-space with the slope and curvature of the fruit under each tip.

    Raises SolveError as `layered_change` does.
    """
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
            if along_normals:  # the contact is round along the skin, the smooth load is round seen from above
                smooth[:, tip, tip] *= stretch_factor(slope)
            else:
                sharp[:, tip, tip] *= slope_factor(fruit.poisson, slope)
                smooth[:, tip, tip] *= slope_factor(fruit.poisson, slope)
    return _LocalChange(sharp=sharp, fewer_nodes=fewer_nodes, smooth=smooth, shell=shell)


def _table_errors(table: Floats, mesh_steps: Floats, local: _LocalChange, rows: Ints) -> Errors:
    """Return the largest relative errors [1] over some rows of a table (moduli, tips, tips) [1/mm].

    They sum a floor, and fractions of three changes: between two meshes, between numbers of nodes, and by the shell.
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
    """Return the change of compliance by layers under level footprints of a half-space, (layers, tips, tips) [1/mm].

    It is times the modulus below the layers. The pressure has `per_side` nodes per side. Raises SolveError on a large
    residual.
    """
    nodes = np.concatenate([footprint.nodes(per_side) for footprint in footprints])
    x, y = nodes.T
    added = added_compliances(layers, np.hypot(x[:, None] - x, y[:, None] - y))
    bare = level_compliance(footprints, layers[0].poisson_below, np.zeros(()), per_side)
    changes = []
    for layer, between in zip(layers, added, strict=True):
        # A half-space of the layer's material, times its own modulus; `between` adds the effect of the material below.
        S = level_compliance(footprints, layer.poisson, layer.modulus * between, per_side) / layer.modulus
        change = S - bare
        for tip, footprint in enumerate(footprints):
            if footprint.punch is circle_punch:  # its own compliance has a closed equation
                radius = 0.5 * footprint.side
                own = 1.0 / round_contact(layer, radius).flat_stiffness(radius)
                change[tip, tip] = own - (1.0 - layer.poisson_below**2) / footprint.side
        changes.append(change)
    return np.array(changes)


def smooth_change(loads: Sequence[SmoothLoad], layers: Sequence[Layer]) -> Floats:
    """Return the change of compliance by layers under smooth loads on a half-space, (layers, loads, loads) [1/mm]."""
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

    It has shape (layers, loads, loads). The fields at `solves` moduli of the skin span the fields at all others. Raises
    SolveError if a solve does not converge.
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
            # A single load is the mean of its parities, hence the half for each mirror plane.
            change[i] += (energy - bare) / 2.0 ** np.abs(parity).sum()
    return change

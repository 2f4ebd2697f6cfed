"""The change in the fruit's compliance due to a skin bonded to the flesh, as a function of the flesh modulus.

As in `solve/fruit/curved_body.py`, a mesh is solved under smooth loads, with and without the skin. The change is
concentrated near a tip, where it equals the change of a layered half-space (`solve/halfspace/layered.py`). The
remaining error is therefore small.

Let m be the modulus of the skin divided by the modulus of the flesh. The stiffness matrix is K_flesh + m K_skin. It is
solved for a few m, and these solutions are the basis of a reduced-order model for all m (Galerkin's method). The
compliance is an energy, so its error is of the order of the square of the error in the reduced solution. All
compliances are multiplied by E.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix

from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from sensor.theory.sloped_skin import slope_factor, stretch_factor
from solve.elasticity import stiffness_matrix
from solve.fruit.bent_block import BentBlock, bent_block, enclosing_core
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
# Ratio of the error bar to the difference between the two meshes. Finer meshes for a pair and a square of tips show an
# error of 0.03 to 0.1 times this difference.
SAFETY = 0.15
FLOOR = 2e-4  # smallest relative error bar, because wider smooth loads change the result by this fraction
# Largest standard deviation of a smooth load. A wider load would act on the boundary of the fruit differently from the
# tip.
DEPTH_FRACTION = 0.125  # limit as a fraction of the depth of the fruit
WIDEST = 4.6  # limit as a multiple of the smallest standard deviation for the tip
FINE_BASIS_SIZE = 3  # number of skin moduli whose solutions form the reduced basis on the fine mesh
COARSE_BASIS_SIZE = 2  # the same number on the coarse mesh
MODULI = 13  # number of moduli in the table
BEYOND = 1.3  # factor by which the table extends above the largest and below the smallest modulus
SOFTEST = 1.0 / 24.0  # modulus at the second point of the curve of P, divided by E_max
# Smallest thickness of the skin [sides], and nodes per side for the pressure of a tip on it.
NODES = ((0.3, 9), (0.1, 17), (0.0, 25))
NODE_SAFETY = 0.1  # ratio of the error to the difference from half as many nodes
SHELL_SAFETY = 0.5  # ratio of the error to the shell effect; finite elements give 0.3 (tests/solve/fruit/test_skin.py)
ROUND_NODES = 9  # nodes per side of a circle, whose compliance under its own load has a closed form


def table_moduli(fruit: Fruit) -> Floats:
    """Return the flesh moduli [MPa] at which the compliance under a skin is tabulated, shape (n,)."""
    smallest = min(*fruit.E_MPa, fruit.E_max_MPa) / BEYOND
    largest = max(*fruit.E_MPa, fruit.E_max_MPa) * BEYOND
    return np.geomspace(min(smallest, SOFTEST * fruit.E_max_MPa), largest, MODULI)


def layer_on(fruit: Fruit, E: float) -> Layer:
    """Return the skin of a fruit as an elastic layer on flesh of modulus E [MPa]."""
    poisson = fruit.poisson if fruit.skin_poisson is None else fruit.skin_poisson
    return Layer(fruit.skin_mm or 0.0, (fruit.skin_E_MPa or E) / E, poisson, fruit.poisson)


def skin_compliance(
    flesh: FruitCompliance, fruit: Fruit, footprints: Sequence[Footprint], along_normals: bool = False
) -> FruitCompliance:
    """Return the compliance [1/mm] of a fruit with its skin, given the compliance `flesh` of the fruit without it.

    For each flesh modulus, the change under smooth loads is solved on a mesh. The difference between the rigid tips on
    the `footprints` and their smooth loads is computed for a layered half-space. With `along_normals`, the tips press
    along the normals of the skin, as domes do. Raises SolveError if a solve does not converge.
    """
    start = time.perf_counter()
    moduli = table_moduli(fruit)
    layers = [layer_on(fruit, E) for E in moduli.tolist()]
    loads = _wide_loads(fruit, footprints)
    local_change = _solve_local_change(fruit, footprints, loads, layers, along_normals)
    mesh_change, mesh_differences, dofs = _solve_mesh_change(fruit, footprints, loads, layers, along_normals)

    # In the change from the mesh, the half-space part under smooth loads is replaced by the half-space part under tips.
    table = flesh.S + mesh_change + local_change.rigid - local_change.smooth - local_change.shell
    # Flesh softer than the design's range occurs only at the start of a curve of P. The error bars exclude it.
    is_in_range = moduli >= min(fruit.E_MPa) / BEYOND * (1.0 - 1e-9)  # the margin is for round-off
    errors = _table_errors(table, mesh_differences, local_change, np.flatnonzero(is_in_range))
    status = f"{flesh.info.status}; under a skin by layered half-space and a mesh of {dofs} dofs with and without it"
    seconds = flesh.info.seconds + time.perf_counter() - start
    return replace(
        flesh,
        skin=SkinTable(E=moduli, S=table),
        difference_error=flesh.difference_error + errors.pair,
        s11_error=flesh.s11_error + errors.own,
        info=replace(flesh.info, method=f"{flesh.info.method}, under a skin", seconds=seconds, status=status),
    )


def _solve_mesh_change(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    layers: Sequence[Layer],
    along_normals: bool,
) -> tuple[Floats, Floats, int]:
    """Return the change in compliance due to the skin on a fine mesh, its difference from a coarse mesh, and the dofs.

    Both arrays (layers, loads, loads) [1/mm] are multiplied by E, and the dofs are counted on the fine mesh. `loads`
    are the smooth loads that replace the footprints. With `along_normals`, they press along the normals of the skin.
    Raises SolveError if a solve does not converge.
    """
    fine_body = bent_block(fruit, footprints, loads, FINE, along_normals)
    coarse_body = bent_block(fruit, footprints, loads, COARSE, along_normals)
    fine_change = body_change(fine_body, layers, FINE_BASIS_SIZE)
    coarse_change = body_change(coarse_body, layers, COARSE_BASIS_SIZE)
    return fine_change, fine_change - coarse_change, int(fine_body.flat.N)


def _wide_loads(fruit: Fruit, footprints: Sequence[Footprint]) -> tuple[SmoothLoad, ...]:
    """Return the smooth loads that replace the footprints on a fruit with a skin.

    Wide loads need few elements, but must not reach the boundary of the fruit. Their width is therefore limited by the
    depth of the fruit, and by a multiple of the smallest standard deviation for the tip.
    """
    ratio_for_depth = DEPTH_FRACTION * fruit.depth_mm / least_deviation(footprints[0])
    return smooth_loads(fruit, footprints, min(WIDEST, max(1.0, ratio_for_depth)))


@dataclass(frozen=True, eq=False)
class _LocalChange:
    """Changes in compliance due to a layer on a half-space, times E [1/mm], each (layers, tips, tips).

    `rigid` is the change under rigid tips. `fewer_nodes` is this change with half as many nodes per side, without the
    effect of the slope. `smooth` is the change under the smooth loads. `shell` is the decrease caused by the stiffness
    of a curved skin as a shell. On a block, it is 0.
    """

    rigid: Floats
    fewer_nodes: Floats
    smooth: Floats
    shell: Floats


def _solve_local_change(
    fruit: Fruit,
    footprints: Sequence[Footprint],
    loads: Sequence[SmoothLoad],
    layers: Sequence[Layer],
    along_normals: bool,
) -> _LocalChange:
    """Return the changes in compliance due to each layer on a half-space, under rigid tips and under smooth loads.

    On a curved fruit, they include the effects of the slope and the curvature under each tip. `loads` are the smooth
    loads that replace the footprints. With `along_normals`, the tips press along the normals of the skin, as domes do.
    Raises SolveError if the nodal forces have a large residual.
    """
    # All layers have the same thickness, and all footprints have the same side and shape.
    per_side = _nodes_on_skin(footprints[0], layers[0].thickness)
    rigid = layered_change(footprints, layers, per_side)
    fewer_nodes = layered_change(footprints, layers, (per_side + 1) // 2)  # half as many, rounded up
    smooth = smooth_change(loads, layers)
    shell = np.zeros_like(rigid)
    if fruit.radius_mm is not None:
        # Slope and curvature mainly affect the compliance of a tip under its own load, which is on the diagonal.
        tips = np.arange(len(footprints))
        shell[:, tips, tips] = _shell_effects(fruit, footprints, loads, layers, per_side)
        rigid_factors, smooth_factors = _slope_factors(fruit, footprints, loads, along_normals)
        rigid[:, tips, tips] *= rigid_factors
        smooth[:, tips, tips] *= smooth_factors
    return _LocalChange(rigid=rigid, fewer_nodes=fewer_nodes, smooth=smooth, shell=shell)


def _nodes_on_skin(footprint: Footprint, thickness: float) -> int:
    """Return the number of nodes per side that the pressure of a tip requires on a skin of this thickness [mm]."""
    if footprint.punch is circle_punch:
        return ROUND_NODES
    return next(nodes for smallest, nodes in NODES if thickness >= smallest * footprint.side)


def _shell_effects(
    fruit: Fruit, footprints: Sequence[Footprint], loads: Sequence[SmoothLoad], layers: Sequence[Layer], per_side: int
) -> Floats:
    """Return the decrease in compliance due to the shell stiffness of a curved skin, times E [1/mm], (layers, tips).

    The result is the decrease under a rigid tip, minus the decrease under the smooth load that replaces the tip. A
    footprint has `per_side` nodes per side.
    """
    curvatures = [1.0 / radius for radius in fruit.radii_mm]
    effects = np.empty((len(layers), len(footprints)))
    for tip, (footprint, load) in enumerate(zip(footprints, loads, strict=True)):
        # Radius of the circular punch that is as stiff as the tip.
        radius = 0.5 * footprint.side * footprint.punch(per_side).flat_stiffness
        effects[:, tip] = [layer.shell_effect(radius, load.deviation, curvatures) for layer in layers]
    return effects


def _slope_factors(
    fruit: Fruit, footprints: Sequence[Footprint], loads: Sequence[SmoothLoad], along_normals: bool
) -> tuple[Floats, Floats]:
    """Return the factors [1] by which the slope under each tip changes the compliance under its own load, (tips,).

    The first factors are for rigid tips, and the second for their smooth loads. With `along_normals`, the tips press
    along the normals of the skin, as domes do.
    """
    shape = CurvedShape(fruit, enclosing_core(loads))
    slopes = [shape.slope(footprint.x, footprint.y) for footprint in footprints]
    if along_normals:
        # The contact of a dome is circular on the skin, so a slope does not change its compliance. The smooth load is
        # circular in plan.
        return np.ones(len(slopes)), np.array([stretch_factor(slope) for slope in slopes])
    factors = np.array([slope_factor(fruit.poisson, slope) for slope in slopes])
    return factors, factors


def _table_errors(table: Floats, mesh_differences: Floats, local_change: _LocalChange, rows: Ints) -> Errors:
    """Return the largest relative errors [1] over some rows of a table (moduli, tips, tips) [1/mm].

    An error is the sum of a floor and of fractions of three differences in compliance. `mesh_differences`, with the
    shape of the table, are the differences between two meshes. `local_change` holds the difference between two numbers
    of nodes, and the shell effect. `rows` holds the indices of the rows.
    """
    node_differences = local_change.rigid - local_change.fewer_nodes
    pair_error = own_error = 0.0  # largest errors of a pair of tips, and of a single tip
    for row in rows:
        S = table[row]
        mesh_error = SAFETY * relative_changes(mesh_differences[row], S)
        node_error = NODE_SAFETY * relative_changes(node_differences[row], S)
        shell_error = SHELL_SAFETY * relative_changes(local_change.shell[row], S)
        errors = largest_errors(FLOOR + mesh_error + node_error + shell_error, len(S))
        pair_error = max(pair_error, errors.pair)
        own_error = max(own_error, errors.own)
    return Errors(pair_error, own_error)


def layered_change(footprints: Sequence[Footprint], layers: Sequence[Layer], per_side: int) -> Floats:
    """Return the change in a half-space's compliance under level footprints, for each layer on it.

    The result is the change times the modulus of the half-space [1/mm], with shape (layers, tips, tips). A footprint
    has `per_side` nodes per side. Raises SolveError if the nodal forces have a large residual.
    """
    nodes = np.concatenate([footprint.nodes(per_side) for footprint in footprints])
    x, y = nodes.T
    base_effects = added_compliances(layers, np.hypot(x[:, None] - x, y[:, None] - y))
    no_remainder = np.zeros(())  # a half-space has no remainder
    without_layer = level_compliance(footprints, layers[0].poisson_below, no_remainder, per_side)
    changes = []
    for layer, base_effect in zip(layers, base_effects, strict=True):
        # The layered half-space is a half-space of the layer's material, plus the effect of the softer or stiffer base
        # between all pairs of nodes. `level_compliance` expects and returns compliances times the modulus of this
        # material. The factor `layer.modulus` converts them from and to the modulus of the base.
        S = level_compliance(footprints, layer.poisson, layer.modulus * base_effect, per_side) / layer.modulus
        change = S - without_layer
        for tip, footprint in enumerate(footprints):
            if footprint.punch is circle_punch:
                change[tip, tip] = _circle_change(layer, footprint)
        changes.append(change)
    return np.array(changes)


def _circle_change(layer: Layer, circle: Footprint) -> float:
    """Return the change in a half-space's compliance under a rigid circle, due to a layer, in closed form.

    The result is the change times the modulus of the half-space [1/mm].
    """
    radius = 0.5 * circle.side
    with_layer = 1.0 / round_contact(layer, radius).flat_stiffness(radius)
    without_layer = (1.0 - layer.poisson_below**2) / circle.side
    return with_layer - without_layer


def smooth_change(loads: Sequence[SmoothLoad], layers: Sequence[Layer]) -> Floats:
    """Return the change in a half-space's compliance under smooth loads, for each layer on it.

    The result is the change times the modulus of the half-space [1/mm], with shape (layers, loads, loads).
    """
    poisson = layers[0].poisson_below
    # A layer that consists of the material below it has no effect, so it represents the half-space without a layer.
    no_layer = Layer(thickness=layers[0].thickness, modulus=1.0, poisson=poisson, poisson_below=poisson)
    with_layer = np.array([_smooth_compliance(loads, layer) for layer in layers])
    return np.asarray(with_layer - _smooth_compliance(loads, no_layer))


def _smooth_compliance(loads: Sequence[SmoothLoad], layer: Layer) -> Floats:
    """Return the compliance of a half-space with a layer under smooth loads, shape (loads, loads).

    An entry is the mean displacement under one load per force of the other, times the modulus of the half-space [1/mm].
    """
    S = np.empty((len(loads), len(loads)))
    for i, displaced_load in enumerate(loads):
        for j, load in enumerate(loads):
            distance = float(np.hypot(displaced_load.x - load.x, displaced_load.y - load.y))
            S[i, j] = layer.smooth_compliance((displaced_load.deviation, load.deviation), distance)
    return S


def body_change(body: BentBlock, layers: Sequence[Layer], solve_count: int) -> Floats:
    """Return the change in compliance due to the skin under the smooth loads of a body, solved on its mesh.

    For loads F and a relative skin modulus m, the change is F.(K_flesh + m K_skin)^-1 F - F.K_0^-1 F. K_0 is the
    stiffness matrix of a body whose skin consists of flesh. The result is the change times E [1/mm], with shape
    (layers, loads, loads). The layers must differ only in their modulus. Displacement fields are solved for
    `solve_count` moduli, and form the reduced basis for all moduli. Raises SolveError if a solve does not converge.
    """
    flesh_matrix, skin_matrix, matrix_without_skin = _body_matrices(body, layers[0])
    moduli = np.array([layer.modulus for layer in layers])
    solved_moduli = np.geomspace(moduli.min(), moduli.max(), solve_count)  # relative moduli of the skin

    load_count = len(body.loads)
    change = np.zeros((len(layers), load_count, load_count))
    for parity in body.parities:
        forces = body.forces(parity, body.normals)
        fixed = body.fixed_dofs(parity)
        compliance_without_skin = forces.T @ factorise(matrix_without_skin, fixed).solve(forces)
        fields = [factorise(flesh_matrix + modulus * skin_matrix, fixed).solve(forces) for modulus in solved_moduli]
        compliances = _solve_reduced(flesh_matrix, skin_matrix, np.hstack(fields), forces, moduli)
        # A single load is the mean of its even and odd parts, hence a factor of one half for each mirror plane.
        change += (compliances - compliance_without_skin) / 2.0 ** np.abs(parity).sum()
    return change


def _body_matrices(body: BentBlock, layer: Layer) -> tuple[csc_matrix, csc_matrix, csc_matrix]:
    """Return the stiffness matrices K_flesh and K_skin of a body, and its matrix K_0 if the skin consists of flesh.

    All moduli are 1, so K_skin is the matrix of a skin with the modulus of the flesh. The `layer` determines the
    thickness of the skin and both Poisson's ratios.
    """
    # Elements of the skin are marked by 1, and elements of the flesh by 0. In the flat block, where z points downwards,
    # the centre of a skin element is above the base of the skin.
    in_skin = (body.flat.mesh.p[2, body.flat.mesh.t].mean(axis=0) < layer.thickness).astype(np.float64)
    flesh_matrix = stiffness_matrix(body.bent, 1.0 - in_skin, layer.poisson_below, b_bar=True)
    skin_matrix = stiffness_matrix(body.bent, in_skin, layer.poisson, b_bar=True)
    skin_of_flesh = stiffness_matrix(body.bent, in_skin, layer.poisson_below, b_bar=True)
    return flesh_matrix, skin_matrix, flesh_matrix + skin_of_flesh


def _solve_reduced(
    flesh_matrix: csc_matrix, skin_matrix: csc_matrix, fields: Floats, forces: Floats, moduli: Floats
) -> Floats:
    """Return F.(K_flesh + m K_skin)^-1 F (moduli, loads, loads) for each relative skin modulus m, by Galerkin's method.

    `flesh_matrix` and `skin_matrix` are K_flesh and K_skin, and `forces` (dofs, loads) are F. The solution is
    approximated by linear combinations of the displacement `fields` (dofs, n).
    """
    reduced_basis, _ = np.linalg.qr(fields)  # orthonormal
    reduced_forces = reduced_basis.T @ forces
    reduced_flesh = reduced_basis.T @ (flesh_matrix @ reduced_basis)
    reduced_skin = reduced_basis.T @ (skin_matrix @ reduced_basis)
    compliances = []
    for modulus in moduli:
        solution = np.linalg.solve(reduced_flesh + modulus * reduced_skin, reduced_forces)
        compliances.append(reduced_forces.T @ solution)
    return np.array(compliances)

"""Hard cases for springs: leaves and designs at their limits, meshes of bad quality, and nearly free bodies."""

import dataclasses
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks import contact
from benchmarks.bars.check import WIDEST_ERROR, ReferenceCheck, make_checks, try_reference
from benchmarks.flexure import BENCH, E_MPA, HOUSING, POISSON, stiffness_on
from benchmarks.harness import Reference
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from mesh.housing.sweep import flexure_mesh
from mesh.quality import check_quality
from pipeline.options import RunOptions, load_design
from pipeline.response.contact import contact_compliance
from pipeline.springs.fitted_springs import springs_for
from pipeline.springs.leaf_lengths import DEFAULT, HousingSolver, MeshPair
from pipeline.springs.mounts import mount_layers
from pipeline.springs.sizing import spring_sizing
from reference.direct_fruit import direct_compliance
from reference.element_study import element_basis
from reference.fruit_meshes import REFINEMENTS, fruit_mesh, solved_block
from reference.small_housing import SMALL_HOUSING
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design, Print, Targets
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.elasticity import stiffness_matrix
from solve.housing.stiffness import housing_stiffness, tip_compliance
from solve.linear import factorise

FINER = 0.5  # scale of the reference mesh, which has more than four times the dofs
TARGET_TOLERANCE = 5e-3  # largest relative difference of a fitted stiffness from its target
LEAST_QUALITY = 0.05  # smallest scaled Jacobian of the elements with which a mesh with moved nodes is solved
# Largest useful relative error bar of a strain; strains are less exact, because they are extrapolated to element edges.
WIDEST_STRAIN_ERROR = 0.15
STOP_DEFLECTIONS = (0.1, 0.1)  # deflections [mm] at which the stops are placed; they do not affect the stiffness
SHIFT_TOLERANCE = 1e-4  # largest relative error of a rigid-body shift: a tenth of the tolerance of fitted springs
BLOCK, TIPS, TARGETS = Fruit(), Tips(), Targets()


def stiffness_checks(
    housing: Housing, E: float, poisson: float, pairs: Sequence[MeshPair] = (DEFAULT,)
) -> tuple[ReferenceCheck, ...]:
    """Return the checks of both spring stiffnesses [N/mm] on each pair of meshes against a finer mesh; E in MPa.

    Raises MeshError if a fine mesh differs from the solid of the housing.
    """
    reference = try_reference(partial(_finer_stiffness, housing, E, poisson))
    checks: list[ReferenceCheck] = []
    for pair in pairs:
        solver = HousingSolver(E, poisson)
        stiffness = stiffness_on(pair, housing, solver)
        solver.check(pair.fine)
        checks += make_checks(BENCH.values, stiffness.K, stiffness.error, reference)
    return tuple(checks)


def _finer_stiffness(housing: Housing, E: float, poisson: float) -> Reference:
    """Return the stiffnesses [N/mm] in the same mount on a mesh with more than four times the dofs."""
    finer = tip_compliance(flexure_mesh(housing, FINER), E, poisson, mount_layers(housing))
    return Reference(values=tuple(finer.K), errors=(), source=f"finer mesh, {finer.dofs} dofs")


def leaf_checks(thickness: float, length: float, depth: float) -> tuple[ReferenceCheck, ...]:
    """Return the checks of a housing whose low leaves have this size [mm]; the high leaves have the same depth."""
    low = dataclasses.replace(HOUSING.low, thickness=thickness, length=length, depth=depth)
    high = dataclasses.replace(HOUSING.high, depth=depth)
    housing = dataclasses.replace(HOUSING, tip_side=min(HOUSING.tip_side, depth))
    return stiffness_checks(housing.with_flexures({"low": low, "high": high}), E_MPA, POISSON)


def short_leaf_checks(truth: Reference) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the stiffness of the small housing [N/mm] against values from another program."""
    fine, coarse = (tip_compliance(flexure_mesh(SMALL_HOUSING, scale), E_MPA, POISSON) for scale in (1.0, 2.0))
    stiffness = housing_stiffness(fine, coarse)
    return make_checks(BENCH.values, stiffness.K, stiffness.error, truth)


def mount_checks(preset: str, mount: str, lengths: Sequence[float]) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the stiffness, the root strain and the sag of a preset's housing against a finer mesh.

    `mount` is the mount of the housing. `lengths` [mm] are the lengths of the low and the high leaves.
    """
    design = load_design(preset, {"print.mount": mount})
    low, high = lengths
    housing = housing_for(design, design.process, (low, high), STOP_DEFLECTIONS)
    E, poisson = design.process.E_MPa, design.process.poisson
    solved = stiffness_on(DEFAULT, housing, HousingSolver(E, poisson))
    finer = tip_compliance(flexure_mesh(housing, FINER), E, poisson, mount_layers(housing))
    true_K, true_strain, true_sag = (
        Reference(values=values, errors=(), source=f"finer mesh, {finer.dofs} dofs")
        for values in (finer.K, finer.strain_per_N, finer.weight_sag)
    )
    return (
        *_check_both_springs("K", solved.K, solved.error, true_K, DEFAULT.least_tolerance),
        *_check_both_springs("strain", solved.strain_per_N, solved.strain_error, true_strain, WIDEST_STRAIN_ERROR),
        *_check_both_springs("sag", solved.weight_sag, solved.weight_sag_error, true_sag, WIDEST_ERROR),
    )


def _check_both_springs(
    quantity: str, values: Sequence[float], errors: Sequence[float], reference: Reference, widest: float
) -> list[ReferenceCheck]:
    """Return the checks of a quantity of the low and the high spring, given its values and their relative errors [1].

    An error bar wider than `widest` [1] is useless, and therefore wrong.
    """
    checks = make_checks((f"{quantity}_l", f"{quantity}_h"), values, errors, reference)
    return [dataclasses.replace(check, widest=widest) for check in checks]


def design_checks(targets: Targets = TARGETS, fruit: Fruit = BLOCK) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the springs of a design; raises InputError if a spring cannot be made."""
    return _springs_checks(Design(targets=targets, fruit=fruit))


def _springs_checks(design: Design) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the fitted springs of a design against a finer mesh and against their targets.

    Raises InputError if a spring cannot be printed; the message is the reason of the verdict.
    """
    sizing = spring_sizing(design, contact_compliance(design.fruit, design.tips), RunOptions())
    fitted = springs_for(design, sizing, "fitted")
    housing = fitted.housing
    verdicts = list(fitted.printable.values())
    failed = [verdict for verdict in verdicts if verdict.passed is False]
    if failed or housing is None:
        verdict = failed[0] if failed else verdicts[0]  # without a failed verdict, the first states the reason
        msg = f"{verdict.name}: {verdict.reason}"
        raise InputError(msg)
    springs = fitted.springs.values()
    stiffnesses = [spring.stiffness for spring in springs]
    targets = Reference(values=tuple(spring.target for spring in springs), errors=(), source="target")
    return (
        *stiffness_checks(housing, fitted.process.E_MPa, fitted.process.poisson),
        *make_checks(BENCH.values, stiffnesses, (TARGET_TOLERANCE,) * len(stiffnesses), targets),
    )


def process_checks(process: str, P_max: float, NL: float) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the springs that a process makes for these targets on the paper's block.

    Raises InputError if the process cannot make them.
    """
    return _springs_checks(Design(targets=Targets(P_max=P_max, NL=NL), print=Print(process=process)))


def moved_node_checks(fraction: float) -> tuple[ReferenceCheck, ...]:
    """Return the checks of s11 - s12 and s11 on meshes whose inner nodes are moved at random.

    Nodes move by up to a `fraction` [1] of their shortest edge along each axis. Raises MeshError if an element becomes
    too flat, before any mesh is solved.
    """
    meshes = [_mesh_with_moved_nodes(scale, fraction) for scale in REFINEMENTS]
    for mesh in meshes:
        check_quality(np.asarray(mesh.p), np.asarray(mesh.t), LEAST_QUALITY)
    compliance = direct_compliance(meshes, BLOCK.poisson)
    values = contact.compliance_values(compliance.S)
    return make_checks(contact.BENCH.values, values, contact.relative_errors(compliance), contact.BENCH.reference)


def _mesh_with_moved_nodes(scale: float, fraction: float) -> Any:
    """Return a mesh of the fruit whose inner nodes are moved at random, to test meshes of bad quality.

    `scale` is the relative element size. A node moves by up to a `fraction` of its shortest edge along each axis. The
    nodes of the surface stay, so that the shape of the fruit is preserved.
    """
    mesh = fruit_mesh(solved_block(BLOCK, TIPS), BLOCK, TIPS, scale)
    points = np.array(mesh.p)
    edge_lengths = np.linalg.norm(points[:, mesh.edges[1]] - points[:, mesh.edges[0]], axis=0)
    shortest = np.full(points.shape[1], np.inf)  # length of the shortest edge at each node
    for ends in mesh.edges:  # the first and the second ends of all edges
        np.minimum.at(shortest, ends, edge_lengths)
    outer = np.unique(mesh.facets[:, mesh.boundary_facets()])
    inner = np.setdiff1d(np.arange(points.shape[1]), outer)
    shift = np.random.default_rng(1).uniform(-1.0, 1.0, (3, len(inner)))  # a fixed seed makes the mesh reproducible
    points[:, inner] += fraction * shortest[inner] * shift
    return dataclasses.replace(mesh, doflocs=points)


def grounded_checks(fraction: float) -> tuple[ReferenceCheck, ...]:
    """Return the check that a block on weak springs moves as a rigid body, under a matrix that is nearly singular.

    Each dof of the block has a spring of the stiffness k, and each vertical dof is loaded with the force k. All
    vertical displacements are then 1. The stiffness k is a small `fraction` [1] of the largest diagonal entry of the
    stiffness matrix, so that the block is nearly free.
    """
    basis = element_basis(fruit_mesh(solved_block(BLOCK, TIPS), BLOCK, TIPS, 1.0), "tet P2")
    K = stiffness_matrix(basis, 1.0, BLOCK.poisson)
    k = fraction * float(K.diagonal().max())
    K.setdiag(K.diagonal() + k)
    load = np.zeros(basis.N)
    vertical_dofs = np.concatenate([basis.nodal_dofs[2], basis.edge_dofs[2]])
    load[vertical_dofs] = k
    no_fixed_dofs = np.zeros(0, dtype=np.int64)
    shifts = factorise(K, no_fixed_dofs).solve(load)[vertical_dofs]
    worst_shift = shifts[np.argmax(np.abs(shifts - 1.0))]
    truth = Reference(values=(1.0,), errors=(), source="rigid body on springs")
    return make_checks(("shift",), (worst_shift,), (SHIFT_TOLERANCE,), truth)

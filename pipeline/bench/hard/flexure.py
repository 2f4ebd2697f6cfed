"""Hard springs: leaves and whole designs at their limits, meshes of bad quality, clamps that hardly hold."""

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from cad.design.parameters import Design, Fruit, Targets, Tips
from cad.parts.fruit import fruit_quarter
from cad.parts.housing import Housing
from mesh.fruit import REFINEMENTS, fruit_mesh
from mesh.housing.sweep import LONGEST_STRETCH, check_jacobian, flexure_mesh, stretched
from mesh.quality import check_quality
from pipeline.bench.contact import REFERENCE
from pipeline.bench.flexure import E_MPA, HOUSING, POISSON
from pipeline.bench.hard.reference_check import Claim, DeclinedError, HardCase
from pipeline.fit.leaf_lengths import COARSE, DEFAULT, Rung, judge_on
from pipeline.stages.contact import contact_compliance
from pipeline.stages.sizing import size
from pipeline.stages.springs import print_springs
from solve.elasticity import stiffness_matrix
from solve.fruit.direct import direct_compliance, tip_stiffness
from solve.housing.element_study import element_basis
from solve.housing.stiffness import HousingStiffness, TipCompliance, housing_stiffness, tip_compliance
from solve.linear import factorised

FINER = 0.5  # scale of the mesh that judges: over four times the dofs
TARGET_TOLERANCE = 5e-3
LEAST_QUALITY = 0.05
DIGITS = 1e-4  # relative: a tenth of what springs are made to
BLOCK, TIPS = Fruit(), Tips()


def stiffness_claims(
    housing: Housing, E: float, poisson: float, rungs: Sequence[Rung] = (DEFAULT,)
) -> tuple[Claim, ...]:
    """Return the claims of each rung on both stiffnesses of a housing, against a mesh of over four times the dofs."""
    finer = tip_compliance(flexure_mesh(housing, FINER), E, poisson)
    claims: list[Claim] = []
    for rung in rungs:
        found = judge_on(rung, housing, E, poisson).stiffness
        claims += _compared(found, finer, f"{found.dofs} against {finer.dofs} dofs")
    return tuple(claims)


def _compared(found: HousingStiffness, finer: TipCompliance, by: str) -> Iterator[Claim]:
    for name, value, error, reference in zip(("K_l", "K_h"), found.K, found.error_percent, finer.K, strict=True):
        yield Claim(name=name, value=value, bar=0.01 * error * value, reference=reference, uncertainty=0.0, by=by)


def leaf_claims(thickness: float, length: float, depth: float) -> tuple[Claim, ...]:
    """Return the claims on a housing whose low flexure has leaves of this size [mm], the high one the same depth."""
    low = dataclasses.replace(HOUSING.low, thickness=thickness, length=length, depth=depth)
    high = dataclasses.replace(HOUSING.high, depth=depth)
    tip = min(HOUSING.tip_side, depth)
    return stiffness_claims(dataclasses.replace(HOUSING, low=low, high=high, tip_side=tip), E_MPA, POISSON)


def design_claims(design: Design) -> tuple[Claim, ...]:
    """Return the claims on both springs of a whole design; raises DeclinedError with a failed verdict."""
    compliance = contact_compliance(design.fruit, design.tips)
    springs = print_springs(design, size(design, compliance, "contact"))
    for spring in (springs.low, springs.high):
        if spring.printable.passed is False:
            msg = f"printable.{spring.name}: {spring.printable.reason}"
            raise DeclinedError(msg)
    if springs.housing is None:
        msg = "printable: undecided, and nothing was made"
        raise DeclinedError(msg)
    claims = stiffness_claims(springs.housing, springs.process.E_MPa, springs.process.poisson)
    targets = tuple(
        Claim(
            name=claim.name, value=spring.stiffness or 0.0, bar=TARGET_TOLERANCE * spring.target,
            reference=spring.target, uncertainty=0.0, by="target",
        )
        for claim, spring in zip(claims, (springs.low, springs.high), strict=True)
    )  # fmt: skip
    return (*claims, *targets)


def jittered_claims(share: float) -> tuple[Claim, ...]:
    """Return the claims on the paper's block from meshes whose inner nodes are moved by a share of their edges."""
    meshes = [_jittered(scale, share) for scale in REFINEMENTS]
    for mesh in meshes:
        check_quality(np.asarray(mesh.p), np.asarray(mesh.t), LEAST_QUALITY)
    found = direct_compliance(meshes, BLOCK, TIPS)
    s11 = found.S[0][0]
    return (
        Claim(
            name="s11", value=s11, bar=0.01 * found.s11_error_percent * s11, reference=REFERENCE["s11"],
            uncertainty=REFERENCE["uncertainty"], by="two independent methods",
        ),
    )  # fmt: skip


def _jittered(scale: float, share: float) -> Any:  # noqa: ANN401 - a mesh of scikit-fem, which this package leaves alone
    mesh = fruit_mesh(fruit_quarter(BLOCK, TIPS), BLOCK, TIPS, scale)
    points = np.array(mesh.p)
    shortest = np.full(points.shape[1], np.inf)
    for ends in mesh.edges:
        np.minimum.at(shortest, ends, np.linalg.norm(points[:, mesh.edges[1]] - points[:, mesh.edges[0]], axis=0))
    inner = np.setdiff1d(np.arange(points.shape[1]), np.unique(mesh.facets[:, mesh.boundary_facets()]))
    shift = np.random.default_rng(1).uniform(-1.0, 1.0, (3, len(inner)))
    points[:, inner] += share * shortest[inner] * shift
    return dataclasses.replace(mesh, doflocs=points)


def folded_claims(reach: float) -> tuple[Claim, ...]:
    """Return no claim: a mesh one node of which is moved by a reach [mm] into its neighbours must be refused."""
    mesh = flexure_mesh(HOUSING)
    places = np.array(mesh.doflocs)
    far = np.abs(places[:, : mesh.nvertices] - [[-18.0], [0.0], [7.6]]).sum(axis=0)
    places[0, int(np.argmin(far))] += reach
    check_jacobian(dataclasses.replace(mesh, doflocs=places))
    return ()


def stretched_claims(factor: float) -> tuple[Claim, ...]:
    """Return the claims on a housing whose meshes are those of shorter leaves, stretched, against a fresh fine one."""
    low, high = (dataclasses.replace(one, length=factor * one.length) for one in (HOUSING.low, HOUSING.high))
    longer = dataclasses.replace(HOUSING, low=low, high=high)
    meshes = [stretched(flexure_mesh(HOUSING, scale), HOUSING, longer) for scale in (1.0, COARSE)]
    if None in meshes:
        msg = f"leaf length = {factor:g} times that of the mesh: must be within {LONGEST_STRETCH:g}; make a fresh mesh"
        raise DeclinedError(msg)
    found = housing_stiffness(*(tip_compliance(mesh, E_MPA, POISSON) for mesh in meshes))
    found = dataclasses.replace(found, error_percent=DEFAULT.bars(longer, found.error_percent))
    finer = tip_compliance(flexure_mesh(longer, FINER), E_MPA, POISSON)
    return tuple(_compared(found, finer, f"stretched mesh against {finer.dofs} dofs"))


def _near(name: str, value: float, reference: float, bar: float, by: str) -> tuple[Claim, ...]:
    bar *= abs(reference)
    return (Claim(name=name, value=value, bar=bar, reference=reference, uncertainty=0.0, by=by),)


def grounded_claims(share: float) -> tuple[Claim, ...]:
    """Return the claim that a free block on springs k at every dof, k a share of its stiffest, moves by 1 under k."""
    basis = element_basis(fruit_mesh(fruit_quarter(BLOCK, TIPS), BLOCK, TIPS, 1.0), "tet P2")
    K = stiffness_matrix(basis, 1.0, BLOCK.poisson)
    k = share * float(K.diagonal().max())
    K.setdiag(K.diagonal() + k)
    vertical = np.zeros(basis.N)
    vertical[np.unique(basis.nodal_dofs[2])] = k
    vertical[np.unique(basis.edge_dofs[2])] = k
    u = factorised(K, np.zeros(0, dtype=np.int64)).solve(vertical)
    moved = u[vertical > 0.0]
    return _near("shift", float(moved[np.argmax(np.abs(moved - 1.0))]), 1.0, DIGITS, "rigid body on springs")


def clamp_claims(kind: str) -> tuple[Claim, ...]:
    """Return no claim: a block that can move freely must be refused."""
    basis = element_basis(fruit_mesh(fruit_quarter(BLOCK, TIPS), BLOCK, TIPS, 1.0), "tet P2")
    K = stiffness_matrix(basis, 1.0, BLOCK.poisson)
    if kind == "sideways":
        held = {"base": (1, 2), "symmetry_x": (1,), "symmetry_y": (2,)}
        return _near("stiffness", float(tip_stiffness(basis, K, held, ("high_tip",))[0, 0]), 1.0, DIGITS, "nothing")
    nodes = {"line": np.flatnonzero(np.abs(basis.mesh.p[0]) + np.abs(basis.mesh.p[1]) < DIGITS), "node": np.array([0])}
    fixed = basis.nodal_dofs[:, nodes[kind]].ravel()
    factorised(K, fixed)
    return _near("stiffness", 0.0, 1.0, DIGITS, "nothing")


LEAVES = (
    ("L/t 5", (0.8, 4.0, 10.0)),
    ("L/t 150", (0.8, 120.0, 10.0)),
    ("t/w 0.02", (0.8, 24.2, 40.0)),
    ("t/w 2", (0.8, 24.2, 0.4)),
    ("L/t 5, t/w 2", (0.8, 4.0, 0.4)),
    ("L/t 150, t/w 0.02", (0.2, 30.0, 10.0)),
    ("L/t 1.2: no leaf left between its fillets", (0.8, 0.96, 10.0)),
)
DESIGNS: tuple[tuple[str, dict[str, float], dict[str, float]], ...] = (
    ("P_max 5, NL 0.05", {}, {}),
    ("P_max 3, NL 0.1", {"P_max": 3.0, "NL": 0.1}, {}),
    ("P_max 1.05, NL 0.05", {"P_max": 1.05}, {}),
    ("P_max 50, NL 0.05", {"P_max": 50.0}, {}),
    ("P_max 5, NL 0.005", {"NL": 0.005}, {}),
    ("P_max 5, NL 0.2", {"NL": 0.2}, {}),
    ("E_max 1e-3 MPa", {}, {"E_max_MPa": 1e-3}),
    ("E_max 1e5 MPa", {}, {"E_max_MPa": 1e5}),
)


def cases() -> Iterator[HardCase]:
    """Yield the hard leaves, designs, meshes and clamps."""
    for what, (thickness, length, depth) in LEAVES:
        yield HardCase(group="leaf", what=what, claims=partial(leaf_claims, thickness, length, depth))
    for what, targets, fruit in DESIGNS:
        design = Design(targets=Targets(**targets), fruit=Fruit(**fruit))  # type: ignore[arg-type]
        yield HardCase(group="design", what=what, claims=partial(design_claims, design))
    for share in (0.1, 0.3, 1.0):
        yield HardCase(
            group="mesh", what=f"inner nodes moved by {share:g} edges", claims=partial(jittered_claims, share)
        )
    for factor in (1.2, 1.4):
        what = f"mesh of leaves stretched by {factor:g}"
        yield HardCase(group="mesh", what=what, claims=partial(stretched_claims, factor))
    yield HardCase(group="mesh", what="node of a leaf moved by 2 mm", claims=partial(folded_claims, 2.0))
    for share in (1e-6, 1e-9, 1e-12, 1e-13, 3e-14, 1e-15):
        yield HardCase(group="clamp", what=f"springs of {share:g} of the body", claims=partial(grounded_claims, share))
    for kind, what in (("sideways", "base held sideways only"), ("line", "one line held"), ("node", "one node held")):
        yield HardCase(group="clamp", what=what, claims=partial(clamp_claims, kind))

"""Pairs of meshes of the housing: one to solve on with one to judge it by, and the error bar that the two give."""

from dataclasses import dataclass

from cad.parts.housing import Housing
from cad.theory.leaf_spring import Flexure
from solve.housing.stiffness import ERROR_SHARE

COARSE = 2.0  # scale of the mesh that finds the lengths


@dataclass(frozen=True, kw_only=True)
class MeshPair:
    """Scales of the mesh that is solved and of the coarser one that judges it, and the error bar made of the two.

    The bar is a share of the difference between both meshes plus a floor [1]; the pair is tried for tolerances from
    `least_tolerance` [1] on.
    """

    fine: float
    coarse: float
    share: float
    floor: float
    least_tolerance: float

    def errors(self, housing: Housing, estimated: tuple[float, ...]) -> tuple[float, ...]:
        """Return the relative error [1] of each spring's stiffness from those of `housing_stiffness`.

        Those of a housing with gauges stand: the edges of the foils make most of them.
        """
        if housing.gauges != "none":
            return estimated
        share = self.share / ERROR_SHARE
        return tuple(
            odd_shape_factor(arm.flexure) * share * error + self.floor
            for arm, error in zip(housing.arms, estimated, strict=True)
        )


DEFAULT = MeshPair(fine=1.0, coarse=2.0, share=ERROR_SHARE, floor=1e-4, least_tolerance=1e-3)
# Seen of the difference: 0.27 on the first, against 112 thousand dofs and 30 random designs; 0.024 on the last, against
# one arm of five designs with 2.7 times the dofs, which is 0.026 against four times. tests/fits/mesh_pairs.py
MESH_PAIRS = (
    MeshPair(fine=2.0, coarse=4.0, share=0.3, floor=2e-4, least_tolerance=1e-2),
    DEFAULT,
    MeshPair(fine=0.5, coarse=2.0, share=0.03, floor=1e-5, least_tolerance=0.0),
)


def mesh_pairs_for(housing: Housing, tolerance: float) -> tuple[MeshPair, ...]:
    """Return the pairs to try for a relative tolerance [1], cheapest first; gauges are extrapolated from one pair."""
    if housing.gauges != "none":
        return (DEFAULT,)
    return tuple(pair for pair in MESH_PAIRS if pair.least_tolerance <= tolerance)


def odd_shape_factor(flexure: Flexure) -> float:
    """Return by how much the difference of two meshes is a worse guide for a leaf of an odd shape [1].

    All meshes have like fans at the roots, whose error shows where a leaf is not much deeper than thick, and few
    layers for the bending across a leaf that is deeper than long. Of the 2.5 for a leaf as thick as deep 2 was seen.
    """
    shallow = min(1.0, flexure.thickness / flexure.depth)
    short = max(0.0, 1.0 - flexure.length / (0.8 * flexure.depth))
    return 1.0 + 1.5 * shallow + 2.0 * short

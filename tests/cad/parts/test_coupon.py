from dataclasses import replace

import numpy as np
import pytest

from cad.checks.triangle_checks import printability_verdicts
from cad.files.stl import triangles
from cad.parts.coupon import largest_weight, modulus_factor
from cad.parts.coupon_solid import coupon_part
from cad.parts.pose import print_pose
from sensor.design.processes import PROCESSES
from sensor.theory.elastica import cantilever


def test_factor_with_fillets_is_the_integral(housing):
    flexure, b = housing.low, 3.5
    s = (np.arange(400_000) + 0.5) / 400_000 * flexure.length
    from_root = np.minimum(s, flexure.length - s)
    inside = np.maximum(flexure.fillet - from_root, 0.0)
    thickness = flexure.thickness + 2.0 * (flexure.fillet - np.sqrt(flexure.fillet**2 - inside**2))
    share = 12.0 * (flexure.length + b - s) ** 2 / (flexure.depth * thickness**3)
    assert modulus_factor(flexure) == pytest.approx(share.mean() * flexure.length, rel=1e-6)
    assert modulus_factor(flexure) < modulus_factor(replace(flexure, fillet=1e-4))


def test_largest_weight_strains_the_root_as_asked(housing):
    force = largest_weight(housing.low, 2000.0, 0.003)
    moment, section = force * (housing.low.length + 3.5), housing.low.depth * housing.low.thickness**2 / 6.0
    assert moment / section / 2000.0 == pytest.approx(0.003)


def test_a_long_leaf_carries_no_weight_that_the_law_of_small_deflections_misses(housing):
    """By the elastica of a cantilever: where the largest weight bends it, it is at most 1 % stiffer than that law."""
    slender = replace(housing.low, length=80.0)
    force = largest_weight(slender, 2000.0, 0.0033)
    sag = force * modulus_factor(slender) / 2000.0 / (slender.length + 3.5)
    assert sag < 0.0033 * 2.0 / 3.0 * 83.5 / slender.thickness
    bent = cantilever(np.linspace(0.0, 0.5, 501)[1:])
    assert 0.005 < np.interp(sag, bent.deflection, bent.stiffening) < 0.01


def test_coupon_can_be_printed(housing):
    mesh = triangles(print_pose(coupon_part(housing).shape))
    findings = printability_verdicts(mesh, PROCESSES["fdm-petg"], ("as it stands",))
    assert [finding.passed for finding in findings] == [True, True, True]
    assert mesh.body_count == 1

"""Whether a polynomial may stand for the contact of a study, and the scenes that it is fitted to."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.stats import qmc

from cad.quantity import InputError
from pipeline.study.levels.contact_surrogate import POISSON, RATIOS, ContactSurrogate, Domain, coordinate, fit_surrogate
from pipeline.study.levels.unit_scene import UnitScene, unit_scene
from pipeline.study.points import design_of, point_at
from pipeline.study.study_file import Study
from pipeline.study.variation import Span
from solve.fruit.compliance import FruitCompliance
from solve.fruit.split import SplitDomainError, check_domain, tip_footprints

SolveScenes = Callable[[Sequence[UnitScene]], list[FruitCompliance]]

FEWEST_SCENES = 2_000  # points of a study from which a fit costs less than the solves that it saves
DEGREES = (3, 4, 5, 6)
SHARE = 0.5  # of the study's tolerance: the other half is for the solves
_OVER = 1.8  # scenes for each term
_CHECKED = 64
_FIT_SEED, _CHECK_SEED = 1, 2
_CONTACT_TABLES = ("fruit", "tips")
_FREE = ("fruit.E_MPa", "fruit.E_max_MPa", "fruit.bruise_limit_MPa", "fruit.poisson_spread", "tips.gap_mm")
_LENGTHS = ("fruit.length_mm", "fruit.width_mm", "fruit.height_mm", "tips.spacing_mm", "tips.side_mm")
_VARIABLE = (*_LENGTHS, f"fruit.{POISSON}")


def scene_keys(study: Study) -> tuple[str, ...]:
    """Return the keys that vary and that contact depends on."""
    return tuple(key for key in study.vary if key.split(".")[0] in _CONTACT_TABLES and key not in _FREE)


def may_interpolate(study: Study, count: int) -> bool:
    """Say whether a polynomial may stand for the contact of a study with so many points; raises InputError.

    It may where flat tips on a block vary by spans of lengths and Poisson's ratio, at the level of contact; unless it
    is asked for, there must be many scenes.
    """
    if study.contact == "solve":
        return False
    keys = scene_keys(study)
    reason = _no_polynomial(study, keys)
    if reason and study.contact == "surrogate":
        msg = f"contact = 'surrogate': must be a study that a polynomial serves, and {reason}; set contact = 'solve'"
        raise InputError(msg)
    wanted = study.contact == "surrogate" or (study.how == "sobol" and count >= FEWEST_SCENES)
    return not reason and wanted


def _no_polynomial(study: Study, keys: Sequence[str]) -> str:
    """Return in words why no polynomial serves; nothing where one does."""
    if study.level != "contact":
        return "its level is above contact"
    if not keys:
        return "nothing that contact depends on varies"
    others = [key for key in keys if key not in _VARIABLE or not isinstance(study.vary[key], Span)]
    if others:
        return f"{others[0]} varies otherwise than by a span of lengths"
    middle = unit_scene(design_of(study, point_at(study, 0, [0.5] * len(study.vary)).settings))
    if middle.fruit.shape != "block" or not middle.tips.tip_shape.has_flat_face or middle.tips.fillet_mm:
        return "the fruit is no block or the tips are not flat"
    return ""


def coordinates(study: Study) -> tuple[str, ...]:
    """Return the fewest coordinates that tell the scenes of a study apart: ratios of lengths, and Poisson's ratio.

    The logarithm of a ratio is linear in those of the lengths: ratios are taken while their rank grows. Where all
    lengths vary there is one less, as size alone changes no scene.
    """
    varied = [key.split(".")[1] for key in scene_keys(study)]
    chosen: list[str] = []
    rows: list[list[int]] = []
    for name, (above, below) in RATIOS.items():
        row = [(key == above) - (key == below) for key in varied if key != POISSON]
        if row and np.linalg.matrix_rank([*rows, row]) > len(rows):
            chosen.append(name)
            rows.append(row)
    return (*chosen, *([POISSON] if POISSON in varied else []))


def scene_domain(study: Study) -> Domain:
    """Return the coordinates of the scenes of a study with their bounds: those at the ends of all spans together."""
    names = coordinates(study)
    spans = {key: varied for key in scene_keys(study) if isinstance(varied := study.vary[key], Span)}
    design = design_of(study, point_at(study, 0, [0.5] * len(study.vary)).settings)
    middle = {**vars(design.fruit), "spacing_mm": design.tips.spacing_mm, "side_mm": design.tips.side_mm}
    corners = []
    for ends in itertools.product((0.0, 1.0), repeat=len(spans)):
        pairs = zip(spans.items(), ends, strict=True)
        given = {key.split(".")[1]: span.at(end) for (key, span), end in pairs}
        corners.append([coordinate({**middle, **given}, name) for name in names])
    columns = list(zip(*corners, strict=True))
    return Domain(coordinates=names, lower=tuple(map(min, columns)), upper=tuple(map(max, columns)))


def drawn_scenes(study: Study, count: int, seed: int) -> Iterator[UnitScene]:
    """Yield scenes of a study inside the domain of the split, drawn apart from its points by a seed of their own.

    They crowd at the ends of the spans as the zeros of a Chebyshev polynomial do: there a fit errs most.
    """
    sequence = qmc.Sobol(len(study.vary), scramble=True, rng=study.seed + seed)
    for shares in sequence.random(count).tolist():
        drawn = [0.5 - 0.5 * math.cos(math.pi * share) for share in shares]
        try:
            scene = unit_scene(design_of(study, point_at(study, 0, drawn).settings))
            check_domain(scene.fruit, tip_footprints(scene.tips))
        except (InputError, SplitDomainError):
            continue
        yield scene


def fitted_surrogate(study: Study, solve: SolveScenes) -> ContactSurrogate | None:
    """Return the polynomial of least degree whose error is half of the study's tolerance; None where none is.

    `solve` gives the compliance of scenes, in their order. Raises what it raises.
    """
    domain = scene_domain(study)
    checked = list(drawn_scenes(study, _CHECKED, _CHECK_SEED))
    checks = solve(checked)
    scenes: list[UnitScene] = []
    solved: list[FruitCompliance] = []
    for degree in DEGREES:
        terms = math.comb(len(domain.coordinates) + degree, degree)
        wanted = list(drawn_scenes(study, 2 ** math.ceil(math.log2(_OVER * terms)), _FIT_SEED))
        solved += solve(wanted[len(scenes) :])
        scenes = wanted
        if len(scenes) < terms or not checked:
            return None
        found = fit_surrogate((scenes, solved), (checked, checks), domain, degree, study.tol)
        if found.error <= SHARE * study.tol:
            return found
    return None

"""Verdicts on leaves of sheet in a printed frame: slots, free length, room around the strips, stops, stock, the tool.

Slots and shoulders are measured by lines through the printed bodies, which hold no strip.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

import cadquery as cq

from cad.checks.clearance import LEAF_GAP_MM, guided_share
from cad.checks.line_probe import UP, Lines, Vector, open_ahead, solid_lines
from cad.checks.tip_checks import PLACE_TOLERANCE_MM
from cad.parts.housing import Arm, Housing, Strip
from cad.parts.part import one_shape
from cad.parts.sensor import SensorSolids
from cad.parts.spacer import HANDLE_MM, RAIL, block_levels, block_name
from cad.parts.strips import cut_strips, pieces_of_stock, widest_first
from sensor.design.leaves import SHOULDER_STRAIN
from sensor.design.processes import Process
from sensor.design.sheets import SoldSheet
from sensor.theory.leaf_spring import root_strain
from sensor.verdict import Verdict, at_least, equal, failed_verdict, one_sided

_DOWN: Vector = (0.0, 0.0, -1.0)
_LEFT: Vector = (-1.0, 0.0, 0.0)
_RIGHT: Vector = (1.0, 0.0, 0.0)
_ACROSS = (-0.42, 0.03, 0.42)  # shares of the depth, none on the plane of symmetry
_ALONG_SLOT = (0.07, 0.47, 0.93)  # shares of its length, none in its middle, below which edges of a tip may lie
_ALONG_STRIP = (0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98)  # shares of the free length, from the wall
_BESIDE_SLOT_MM = 0.05  # from a face of a slot, where the face of its shoulder is measured
_OUT_OF_WAY = (0.0, 0.02, 0.25, 0.5, 0.75, 1.0)  # shares of the way on which a tool is taken out
_SAME_PLACE_MM3 = 1e-6  # of two bodies that touch each other


def strip_verdicts(
    sensor: SensorSolids, strips: cq.Shape, forms: Mapping[str, Lines], deflections: Sequence[float]
) -> tuple[Verdict, ...]:
    """Return every verdict on the strips of a sensor in its printed bodies; none where its leaves are printed.

    `strips` are theirs, as read from a file or made, `forms` those of the printed bodies, all in the sensor frame. The
    deflections [mm] of low and high spring are those at full travel.
    """
    housing = sensor.housing
    if housing.clamp is None or sensor.sheet is None:
        return ()
    lines = forms["solid"]
    return (
        _slots(housing, housing.clamp.gap, forms),
        _ends(housing, housing.clamp.end_room, strips, lines),
        *(_free_length(housing, arm, forms) for arm in housing.arms),
        _clearance(housing, lines, deflections),
        _stock(housing, sensor.sheet),
    )


def _slots(housing: Housing, declared: float, forms: Mapping[str, Lines]) -> Verdict:
    """Return geometry.strip_slots [mm]: the layer of glue on each face of a strip that is farthest from the declared.

    Each slot is measured at nine places from the faces of its strip, in every form.
    """
    worst, place = declared, ""
    for (form, lines), (strip, point) in itertools.product(forms.items(), list(_in_slots(housing))):
        half = 0.5 * (strip.z[1] - strip.z[0])
        for direction in (UP, _DOWN):
            gap = open_ahead(lines, point, direction) - half
            if math.isnan(gap):
                reference = f"no slot for the {strip.name} in the {form} at x = {point[0]:.3f} mm"
                return failed_verdict("geometry.strip_slots", declared, unit="mm", reference=reference)
            if abs(gap - declared) > abs(worst - declared):
                worst = gap
                place = f"; farthest in the {form} beside the {strip.name} at x = {point[0]:.3f} mm"
    reference = f"lines from the middle of each strip to both faces of its slots, in {', '.join(forms)}{place}"
    return equal("geometry.strip_slots", worst, declared, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _in_slots(housing: Housing) -> Iterator[tuple[Strip, Vector]]:
    """Yield strips with points on their middle planes within their slots [mm]."""
    for strip in housing.strips:
        level = 0.5 * sum(strip.z)
        for ((start, end), _), along, across in itertools.product(strip.slots, _ALONG_SLOT, _ACROSS):
            yield strip, (start + along * (end - start), across * housing.depth, level)


def _ends(housing: Housing, declared: float, strips: cq.Shape, lines: Lines) -> Verdict:
    """Return geometry.strip_ends [mm]: the room beyond an end of a strip that is farthest from the declared.

    The ends are those of the solids of the strips; the slot is measured from the shoulder.
    """
    name = "geometry.strip_ends"
    boxes = [solid.BoundingBox() for solid in strips.Solids()]
    found = {}
    for strip in housing.strips:
        middle, level = 0.5 * sum(strip.x), 0.5 * sum(strip.z)
        box = min(boxes, key=lambda each: math.hypot(each.center.x - middle, each.center.z - level))
        start = (middle, _ACROSS[1] * housing.depth, level)
        found[f"left of the {strip.name}"] = open_ahead(lines, start, _LEFT) - (middle - box.xmin)
        found[f"right of the {strip.name}"] = open_ahead(lines, start, _RIGHT) - (box.xmax - middle)
    where = max(found, key=lambda each: abs(found[each] - declared))
    reference = f"lines along each strip to the ends of its slots; farthest {where}"
    return equal(name, found[where], declared, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _free_length(housing: Housing, arm: Arm, forms: Mapping[str, Lines]) -> Verdict:
    """Return geometry.free_length_low or _high [mm]: from shoulder to shoulder, what is farthest from the declared.

    A shoulder is measured beside both faces of each slot.
    """
    name = f"geometry.free_length_{arm.name}"
    declared = arm.flexure.length
    worst, place = declared, ""
    middle = 0.5 * sum(arm.roots)
    for (form, lines), strip, across in itertools.product(forms.items(), arm.strips, _ACROSS):
        (_, (foot, top)), _ = strip.slots
        for level in (foot - _BESIDE_SLOT_MM, top + _BESIDE_SLOT_MM):
            start = (middle, across * housing.depth, level)
            length = open_ahead(lines, start, _LEFT) + open_ahead(lines, start, _RIGHT)
            here = f" in the {form} beside the {strip.name} at z = {level:.3f} mm"
            if not math.isfinite(length):
                return failed_verdict(name, declared, unit="mm", reference=f"no two shoulders{here}")
            if abs(length - declared) > abs(worst - declared):
                worst, place = length, f"; farthest{here}"
    reference = f"lines from shoulder to shoulder beside the slots, in {', '.join(forms)}{place}"
    return equal(name, worst, declared, PLACE_TOLERANCE_MM, unit="mm", reference=reference)


def _clearance(housing: Housing, lines: Lines, deflections: Sequence[float]) -> Verdict:
    """Return geometry.strip_clearance [mm]: least distance of a strip between its shoulders from what is printed.

    At rest and at full travel, at which its points have moved as those of a guided leaf, 3 s^2 - 2 s^3.
    """
    name = "geometry.strip_clearance"
    least, place = math.inf, ""
    for arm, deflection in zip(housing.arms, deflections, strict=True):
        half = 0.5 * arm.flexure.thickness
        for level, share, across in itertools.product(arm.levels, _ALONG_STRIP, _ACROSS):
            point = (arm.wall + share * (arm.shuttle - arm.wall), across * housing.depth, level)
            moved = deflection * guided_share(share)
            above = open_ahead(lines, point, UP) - half - max(moved, 0.0)
            below = open_ahead(lines, point, _DOWN) - half
            room = min(above, below)
            if math.isnan(above) or math.isnan(below):
                reference = f"printed material where the {arm.name} strip is, at x = {point[0]:.3f}, z = {level:.3f} mm"
                return failed_verdict(name, LEAF_GAP_MM, unit="mm", reference=reference)
            if room < least:
                least, place = room, f"{arm.name} strip at x = {point[0]:.3f}, z = {level:.3f} mm"
    reference = f"lines up and down from the free strips, at rest and at full travel; least at the {place}"
    return at_least(name, least, LEAF_GAP_MM, 0.0, unit="mm", reference=reference)


def _stock(housing: Housing, sheet: SoldSheet) -> Verdict:
    """Return geometry.strip_stock [1]: how many strips of one kind a piece of sheet yields over how many are needed."""
    yields = {}
    for strips in cut_strips(housing):
        best = max(sheet.stock, key=lambda piece: pieces_of_stock(strips, piece))
        count = pieces_of_stock(strips, best)
        yields[f"{strips.spring}: {count} strips of {strips.size} mm from {best[0]:g} x {best[1]:g} mm"] = (
            count / strips.count
        )
    worst = min(yields, key=yields.__getitem__)
    reference = f"strips that the best piece of {sheet.name} on the shelf yields, over those needed; {worst}"
    return at_least("geometry.strip_stock", yields[worst], 1.0, 0.0, unit="1", reference=reference)


def stop_strain_verdicts(sensor: SensorSolids, stops: Sequence[Verdict]) -> tuple[Verdict, ...]:
    """Return geometry.stop_strain_low and _high [1]: strain of the strips at a shoulder with the shuttle at its stop.

    The stops are the verdicts geometry.stops_low and _high, which measured them. The limit is that of endless bending.
    """
    if sensor.sheet is None:
        return ()
    way = {stop.name: stop.value for stop in stops}
    limit = sensor.sheet.strain_limit
    verdicts = []
    for arm in sensor.housing.arms:
        name = f"geometry.stop_strain_{arm.name}"
        stop = way[f"geometry.stops_{arm.name}"]
        if stop is None:
            verdicts.append(failed_verdict(name, limit, unit="1", reference="no stop holds the shuttle"))
            continue
        flexure = arm.flexure
        strain = SHOULDER_STRAIN * root_strain(flexure.thickness, flexure.length, stop)
        reference = f"{SHOULDER_STRAIN:g} times that of a beam, {stop:.4g} mm up; fatigue limit of {sensor.sheet.name}"
        verdict = Verdict(
            name=name, value=strain, unit="1", limit=limit, tolerance=0.0, passed=strain <= limit, reference=reference
        )
        verdicts.append(one_sided(verdict, "at most"))
    return tuple(verdicts)


def spacer_verdicts(sensor: SensorSolids, spacer: cq.Shape, process: Process) -> tuple[Verdict, ...]:
    """Return geometry.spacer [mm]: how far a block is off its free length, or the rail off the level of the tips.

    The tool stands where it is used. It fails where it cuts into a body, is nearer to a strip than the least gap of the
    process, or cannot be taken out. The blocks are taken out along y by their handles, the rail downwards.
    """
    name = "geometry.spacer"
    housing = sensor.housing
    try:
        parts = _named_tool(housing, spacer)
        errors = list(_tool_errors(housing, parts))
        _refuse_stuck(sensor, parts, process)
    except _ToolError as error:
        return (failed_verdict(name, 0.0, unit="mm", reference=str(error)),)
    worst, off = max(errors, key=lambda each: abs(each[1]))
    reference = f"lines through blocks and rail against free lengths and levels; farthest {worst}"
    return (equal(name, off, 0.0, PLACE_TOLERANCE_MM, unit="mm", reference=reference),)


class _ToolError(ValueError):
    """A tool that cannot be used; the message says why."""


def _named_tool(housing: Housing, spacer: cq.Shape) -> dict[str, cq.Shape]:
    """Return the parts of a tool by name; raises _ToolError for another number of solids."""
    names = [RAIL, *(block_name(arm) for arm in housing.arms)]
    solids = spacer.Solids()
    if len(solids) != len(names):
        msg = f"{len(solids)} solids, must be {len(names)}: {', '.join(names)}"
        raise _ToolError(msg)
    return dict(zip(names, widest_first(solids), strict=True))


def _tool_errors(housing: Housing, parts: Mapping[str, cq.Shape]) -> Iterator[tuple[str, float]]:
    """Yield how far each block is off its free length, and each face of the rail off its level [mm]."""
    for arm in housing.arms:
        lines = solid_lines(parts[block_name(arm)])
        foot, top = block_levels(arm)
        for share in (0.1, 0.5, 0.9):
            point = (0.5 * sum(arm.roots), _ACROSS[1] * housing.depth, foot + share * (top - foot))
            yield block_name(arm), sum(span.leave - span.enter for span in lines(point, _RIGHT)) - arm.flexure.length
    lines = solid_lines(parts[RAIL])
    tops = {arm.centre: 0.0 for arm in housing.arms}
    tops |= {0.5 * (arm.post + arm.outer): housing.protrusion for arm in housing.arms}
    for x, level in tops.items():
        spans = lines((x, _ACROSS[1] * housing.depth, 0.0), UP)
        yield f"rail at x = {x:.3f} mm", max((span.leave for span in spans), default=math.inf) - level


def _refuse_stuck(sensor: SensorSolids, parts: Mapping[str, cq.Shape], process: Process) -> None:
    """Raise _ToolError where a part of the tool cuts into a body on its way out, or is too near to a strip."""
    housing = sensor.housing
    strips = one_shape(body.shape for body in sensor.strip_bodies())
    bodies = {body.name: body.shape for body in (*sensor.printed_bodies(), *sensor.strip_bodies())}
    upwards = 1.0 if housing.back_to_back else -1.0
    ways = {block_name(arm): cq.Vector(0.0, upwards * (housing.depth + HANDLE_MM), 0.0) for arm in housing.arms}
    ways[RAIL] = cq.Vector(0.0, 0.0, -housing.top_level)
    for name, shape in parts.items():
        distance = float(shape.distance(strips))
        if distance < process.min_gap_mm:
            msg = f"the {name} is {distance:.3g} mm from a strip, must be at least {process.min_gap_mm:g} mm"
            raise _ToolError(msg)
        for share, (body, solid) in itertools.product(_OUT_OF_WAY, bodies.items()):
            common = sum(each.Volume() for each in shape.translate(ways[name] * share).intersect(solid).Solids())
            if common > _SAME_PLACE_MM3:
                where = f"{100.0 * share:g} % of the way out" if share else "where it is used"
                msg = f"the {name} cannot be taken out: it cuts into the {body} {where}, {common:.3g} mm^3"
                raise _ToolError(msg)

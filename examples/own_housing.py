"""A housing of one's own: the long leaves of the low spring folded, their thickness found, and the part solved.

Each straight leaf of the default design becomes three shorter passes, one behind the other, in thicker plastic. The
stiffness of leaves goes with the cube of their thickness, so a second solve is near the target. The part is held at its
screw holes. [A part of your own](your-own-part.md) says how it is solved.
"""

from pathlib import Path

import cadquery as cq

import twintip

PASS_MM = 2.2  # between the passes of a folded leaf, middle to middle
SHORTER_MM = 6.0  # from the turns of a leaf to wall and shuttle
FILLET_MM = 0.4  # where a leaf meets wall and shuttle: at a sharp corner strain has no limit, and a solve takes longer

design = twintip.load_design("paper")
result = twintip.evaluate(design)
frame = result.springs.housing
low = frame.arms[0]
wall, shuttle = low.roots  # x of the ends of its leaves
material = {"E_MPa": design.process.E_MPa, "poisson": design.process.poisson}


def folded_leaf(level: float, side: float, thickness: float) -> cq.Solid:
    """Return a leaf with two turns that starts on the shuttle at a level [mm].

    Its passes follow above the level if `side` is 1, and below if -1.
    """
    near, far = wall + SHORTER_MM, shuttle - SHORTER_MM
    step, bulge = side * PASS_MM, 0.5 * PASS_MM
    path = (
        cq.Workplane("XZ")
        .moveTo(shuttle + 1.0, level)
        .lineTo(near, level)
        .threePointArc((near - bulge, level + 0.5 * step), (near, level + step))
        .lineTo(far, level + step)
        .threePointArc((far + bulge, level + 1.5 * step), (far, level + 2.0 * step))
        .lineTo(wall - 1.0, level + 2.0 * step)
    )
    (outline,) = path.wire().val().offset2D(0.5 * thickness)
    along_y = cq.Vector(0.0, frame.depth, 0.0)
    return cq.Solid.extrudeLinear(cq.Face.makeFromWires(outline), along_y).translate(-0.5 * along_y)


def own_housing(thickness: float) -> cq.Workplane:
    """Return the housing of the design with folded leaves in place of the straight ones of its low spring."""
    part = twintip.housing(result)
    half = 0.5 * low.flexure.thickness + low.flexure.fillet
    for level in low.levels:
        cut = cq.Workplane("XZ").center(0.5 * (wall + shuttle), level).rect(shuttle - wall, 2.0 * half)
        part = part.cut(cut.extrude(frame.depth, both=True))
    roots = []
    for level, side in zip(low.levels, (1.0, -1.0), strict=True):
        part = part.union(cq.Workplane(folded_leaf(level, side, thickness)))
        roots += [(shuttle, level), (wall, level + 2.0 * side * PASS_MM)]
    for x, z in roots:
        reach = cq.Vector(0.1, frame.depth, thickness)
        near = cq.selectors.BoxSelector(cq.Vector(x, 0.0, z) - reach, cq.Vector(x, 0.0, z) + reach)
        part = part.edges("|Y").edges(near).fillet(FILLET_MM)
    return part


def solve_part(part: cq.Workplane) -> twintip.PartStiffness:
    """Return the stiffness of a part at its tips; the part is held at the walls of its screw holes."""
    holes = [(x + 0.5 * frame.hole_diameter, 0.0, z) for x, z in frame.holes]
    tips = {arm.name: (arm.centre, 0.0, 0.0) for arm in frame.arms}
    return twintip.stiffness(part, held=holes, pressed=tips, **material)


target = result.springs.springs["low"].target
thickness = 1.0
for _ in range(2):
    part = own_housing(thickness)
    solution = solve_part(part)
    K_l, K_h = (face.estimate for face in solution.faces.values())
    print(f"leaves of {thickness:.2f} mm: K_l {K_l.value:.0f} N/m, K_h {K_h.value:.0f} N/m")
    thickness = round(thickness * (target / solution.faces["low"].K) ** (1.0 / 3.0), 2)
print(f"target of K_l: {1e3 * target:.0f} N/m; the bar is under 1 %: {K_l.error < 0.01 * K_l.value}")

Path("outputs").mkdir(exist_ok=True)
cq.exporters.export(part, "outputs/own-housing.step")

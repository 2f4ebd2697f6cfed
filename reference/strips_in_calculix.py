"""Strips of sheet glued into a frame by CalculiX, on a mesh that shares nothing with the product's.

OpenCASCADE draws the profile as separate bodies, print, glue and strips, and joins them by a fragment. The print has
triangles, glue and strips quadrilaterals. It is swept over the half depth to 15-node wedges and 20-node bricks. The
holes are held; the tips are as deep as the plate. Units: mm, N, MPa.
"""

import io
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import gmsh
import numpy as np

from cad.parts.housing import Housing, profile
from mesh.session import gmsh_session
from sensor.arrays import Floats, Ints

LEVELS = (0.0, 0.5, 0.82, 1.0)  # of the half depth
_NEAR = 1e-6
_KINDS = {3: "C3D15", 4: "C3D20R"}  # by the corners of a piece of the profile


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Numbers of elements along a slot, across a strip and its glue, along a free strip, and lengths in the print."""

    slot: int = 10
    across: int = 2
    free: int = 30
    near: float = 0.12
    far: float = 2.5


def calculix_stiffness(housing: Housing, E: float, poisson: float, sizes: Sizes | None = None) -> tuple[float, ...]:
    """Return the stiffness of both tips, low then high [N/mm], of a housing whose holes are held.

    Raises RuntimeError where CalculiX is absent or fails.
    """
    nodes, pieces = _plane_mesh(housing, sizes or Sizes())
    deck, weights = _deck(housing, nodes, pieces, E, poisson)
    found = _solved(deck)
    stiffnesses = []
    for u, weight in zip(found, weights, strict=True):
        stiffnesses.append(0.5 / float(weight @ u[: len(weight)]))
    return tuple(stiffnesses)


@dataclass(frozen=True)
class _Pieces:
    """Pieces of the profile of one material: corners and middles of edges, (3 or 4, n) each."""

    material: str
    corners: Ints
    middles: Ints


def _rectangle(x: tuple[float, float], z: tuple[float, float]) -> int:
    return int(gmsh.model.occ.addRectangle(min(x), min(z), 0.0, abs(x[1] - x[0]), abs(z[1] - z[0])))


def _print_surface(housing: Housing) -> list[tuple[int, int]]:
    """Draw the plate with its windows and holes, its corners rounded, and return its surfaces."""
    occ = gmsh.model.occ
    points = [occ.addPoint(x, z, 0.0) for x, z in profile(housing)]
    lines = [occ.addLine(a, b) for a, b in pairwise([*points, points[0]])]
    plate = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    cut = [
        (2, occ.addDisk(x, z, 0.0, 0.5 * housing.hole_diameter, 0.5 * housing.hole_diameter)) for x, z in housing.holes
    ]
    r = housing.corner
    added = []
    for arm in housing.arms:
        half = 0.5 * arm.flexure.thickness
        cut.append((2, _rectangle(arm.roots, (arm.levels[0] + half, arm.levels[1] - half))))
        inner = arm.wall - arm.sign * r
        corner = _rectangle((inner, arm.wall), (housing.cavity_level - r, housing.cavity_level))
        disk = occ.addDisk(inner, housing.cavity_level - r, 0.0, r, r)
        added += occ.cut([(2, corner)], [(2, disk)])[0]
    whole, _ = occ.fuse([(2, plate)], added)
    return list(occ.cut(whole, cut)[0])


def _plane_mesh(housing: Housing, sizes: Sizes) -> tuple[Floats, list[_Pieces]]:
    """Return the nodes (2, n) of the profile and its pieces by material."""
    with gmsh_session():
        plate = _print_surface(housing)
        tools = []
        for strip in housing.strips:
            free = (strip.slots[0][0][1], strip.slots[1][0][0])
            for x in ((strip.x[0], free[0]), free, (free[1], strip.x[1])):
                tools.append((2, _rectangle(x, strip.z)))
                if x != free:
                    faces = strip.slots[0][1]
                    tools += [(2, _rectangle(x, (faces[0], strip.z[0]))), (2, _rectangle(x, (strip.z[1], faces[1])))]
        gmsh.model.occ.fragment(plate, tools)
        gmsh.model.occ.removeAllDuplicates()
        gmsh.model.occ.synchronize()
        materials = {tag: _material(housing, tag) for _, tag in gmsh.model.getEntities(2)}
        _set_sizes(housing, materials, sizes)
        gmsh.model.mesh.generate(2)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        gmsh.model.mesh.setOrder(2)
        return _read(materials)


def _material(housing: Housing, tag: int) -> str:
    """Return what a surface is of: by the box that holds it."""
    x0, z0, _, x1, z1, _ = gmsh.model.getBoundingBox(2, tag)
    z = 0.5 * (z0 + z1)
    for strip in housing.strips:
        if strip.x[0] - _NEAR < x0 + 1e-3 and x1 - 1e-3 < strip.x[1] + _NEAR:
            if strip.z[0] < z < strip.z[1] and z1 - z0 < 2.0 * (strip.z[1] - strip.z[0]):
                return "strips"
            faces = strip.slots[0][1]
            if faces[0] < z < faces[1] and z1 - z0 < faces[1] - faces[0]:
                return "glue"
    return "print"


def _set_sizes(housing: Housing, materials: dict[int, str], sizes: Sizes) -> None:
    """Divide the edges of strips and glue, and let the print's elements grow away from them."""
    mesh = gmsh.model.mesh
    shoulders = [x for arm in housing.arms for x in (arm.wall, arm.shuttle)]
    slots = set()
    for tag, material in materials.items():
        if material == "print":
            continue
        for _, curve in gmsh.model.getBoundary([(2, tag)], oriented=False):
            (first,), (last,) = gmsh.model.getParametrizationBounds(1, curve)
            a, b = (gmsh.model.getValue(1, curve, [place]) for place in (first, last))
            if abs(a[0] - b[0]) < _NEAR:
                mesh.setTransfiniteCurve(curve, sizes.across + 1)
                continue
            at_shoulder = [min(abs(point[0] - x) for x in shoulders) < _NEAR for point in (a, b)]
            if all(at_shoulder):
                mesh.setTransfiniteCurve(curve, sizes.free + 1, "Bump", 0.1)
            else:
                mesh.setTransfiniteCurve(curve, sizes.slot + 1, "Progression", 1.25 if at_shoulder[0] else -1.25)
                slots.add(curve)
        mesh.setTransfiniteSurface(tag)
        mesh.setRecombine(2, tag)
    field = mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, "CurvesList", sorted(slots))
    field.setNumber(distance, "Sampling", 200)
    threshold = field.add("Threshold")
    for name, value in {
        "InField": distance, "SizeMin": sizes.near, "SizeMax": sizes.far, "DistMin": 0.05, "DistMax": 6.0,
    }.items():  # fmt: skip
        field.setNumber(threshold, name, value)
    field.setAsBackgroundMesh(threshold)


def _read(materials: dict[int, str]) -> tuple[Floats, list[_Pieces]]:
    """Return nodes and pieces of the mesh that gmsh holds."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    found = []
    for tag, material in materials.items():
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(2, tag), strict=True):
            corners = {9: 3, 16: 4}[int(kind)]  # triangles of six nodes, quadrilaterals of eight
            table = np.searchsorted(np.asarray(tags)[order], np.asarray(nodes)).reshape(-1, 2 * corners).T
            found.append(_Pieces(material, table[:corners], table[corners:]))
    points = np.reshape(coordinates, (-1, 3))[order][:, :2].T
    used = np.unique(np.concatenate([nodes.ravel() for p in found for nodes in (p.corners, p.middles)]))
    number = np.full(points.shape[1], -1)
    number[used] = np.arange(len(used))
    points = points[:, used]
    return points, [_turned(points, _Pieces(p.material, number[p.corners], number[p.middles])) for p in found]


def _turned(points: Floats, pieces: _Pieces) -> _Pieces:
    """Return the pieces clockwise in (x, z): then they face along y."""
    x, z = points[:, pieces.corners]
    area = sum(x[i - 1] * z[i] - x[i] * z[i - 1] for i in range(len(x)))
    back = np.r_[0, np.arange(len(x) - 1, 0, -1)]
    against = area > 0.0
    corners = np.where(against, pieces.corners[back], pieces.corners)
    middles = np.where(against, pieces.middles[::-1], pieces.middles)
    return _Pieces(pieces.material, corners, middles)


def _deck(
    housing: Housing, points: Floats, pieces: list[_Pieces], E: float, poisson: float
) -> tuple[str, list[Floats]]:
    """Return the deck with one step for each tip, and the weights of u_z [1] whose product is half a mean over it."""
    count = points.shape[1]
    levels = 0.5 * housing.depth * np.repeat(LEVELS, 2)[:-1]
    levels[1::2] = 0.5 * housing.depth * 0.5 * (np.array(LEVELS[:-1]) + np.array(LEVELS[1:]))
    file = io.StringIO()
    used = np.zeros((len(levels), count), dtype=bool)
    used[::2] = True
    for piece in pieces:
        used[1::2, np.unique(piece.corners)] = True
    number = np.zeros(used.shape, dtype=np.int64)
    number[used] = np.arange(1, used.sum() + 1)
    file.write("*NODE, NSET=EVERY\n")
    rows = [
        np.column_stack([number[k][used[k]], points[0][used[k]], np.full(used[k].sum(), y), points[1][used[k]]])
        for k, y in enumerate(levels)
    ]
    np.savetxt(file, np.concatenate(rows), "%d, %.12e, %.12e, %.12e")
    element = 1
    for piece in pieces:
        cells = []
        for k in range(0, len(levels) - 1, 2):
            lower, middle, upper = number[k : k + 3]
            cells.append(np.concatenate([lower[piece.corners], upper[piece.corners], lower[piece.middles],
                                         upper[piece.middles], middle[piece.corners]]))  # fmt: skip
        table = np.hstack(cells).T
        file.write(f"*ELEMENT, TYPE={_KINDS[len(piece.corners)]}, ELSET={piece.material.upper()}\n")
        for row in table.tolist():
            words = [str(element), *map(str, row)]
            file.write(",\n".join(", ".join(words[i : i + 8]) for i in range(0, len(words), 8)) + "\n")
            element += 1
    clamp = housing.clamp
    assert clamp is not None
    constants = {
        "PRINT": (E, poisson),
        "GLUE": (clamp.glue_E_MPa, clamp.glue_poisson),
        "STRIPS": (clamp.strip_E_MPa, clamp.strip_poisson),
    }
    for name, (modulus, ratio) in constants.items():
        file.write(f"*MATERIAL, NAME={name}\n*ELASTIC\n{modulus:.12e}, {ratio:.12e}\n")
        file.write(f"*SOLID SECTION, ELSET={name}, MATERIAL={name}\n")
    radius = 0.5 * housing.hole_diameter
    held = np.any([np.abs(np.hypot(points[0] - x, points[1] - z) - radius) < 1e-4 for x, z in housing.holes], axis=0)
    for name, numbers in {"HOLES": number[:, held], "PLANE": number[0]}.items():
        file.write(f"*NSET, NSET={name}\n")
        np.savetxt(file, np.unique(numbers[numbers > 0]), "%d,")
    weights = [_face_weights(points, pieces, number, levels, arm.sign) for arm in housing.arms]
    for weight in weights:
        loaded = np.flatnonzero(weight)
        file.write("*STEP\n*STATIC\n*BOUNDARY, OP=NEW\nHOLES, 1, 3\nPLANE, 2, 2\n*CLOAD, OP=NEW\n")
        np.savetxt(file, np.column_stack([loaded + 1, weight[loaded]]), "%d, 3, %.12e")
        file.write("*NODE PRINT, NSET=EVERY\nU\n*END STEP\n")
    return file.getvalue(), weights


def _face_weights(points: Floats, pieces: list[_Pieces], number: Ints, levels: Floats, sign: float) -> Floats:
    """Return the consistent nodal forces of 0.5 N spread over the half face of the tip on one side, by node."""
    on_face = (np.abs(points[1]) < _NEAR) & (sign * points[0] > 0.0)
    forces = np.zeros(int(number.max()))
    for piece in pieces:
        size = len(piece.corners)
        for i in range(size):
            a, b, middle = piece.corners[i], piece.corners[(i + 1) % size], piece.middles[i]
            for edge in np.flatnonzero(on_face[a] & on_face[b] & on_face[middle]):
                length = abs(points[0, a[edge]] - points[0, b[edge]])
                for k in range(0, len(levels) - 1, 2):
                    area = length * (levels[k + 2] - levels[k])
                    corners = [number[level, node[edge]] for level in (k, k + 2) for node in (a, b)]
                    sides = [
                        number[k, middle[edge]],
                        number[k + 2, middle[edge]],
                        number[k + 1, a[edge]],
                        number[k + 1, b[edge]],
                    ]
                    forces[np.array(corners) - 1] -= area / 12.0
                    forces[np.array(sides) - 1] += area / 3.0
    return 0.5 * forces / forces.sum()


def _solved(deck: str) -> list[Floats]:
    """Return u_z of every node for each step; raises RuntimeError."""
    program = shutil.which("ccx")
    if program is None:
        msg = "CalculiX is absent: the program ccx must be on the path"
        raise RuntimeError(msg)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "strips.inp").write_text(deck, encoding="ascii")
        done = subprocess.run([program, "-i", "strips"], cwd=folder, capture_output=True, encoding="utf-8", check=False)
        if "Job finished" not in done.stdout:
            raise RuntimeError(done.stdout[-500:])
        text = (folder / "strips.dat").read_text(encoding="ascii")
    tables = []
    for part in text.split("displacements")[1:]:
        rows = [line.split() for line in part.splitlines()[1:]]
        table = np.array([[float(word) for word in row] for row in rows if len(row) == 4 and row[0].isdigit()])
        u = np.zeros(int(table[:, 0].max()))
        u[table[:, 0].astype(int) - 1] = table[:, 3]
        tables.append(u)
    return tables

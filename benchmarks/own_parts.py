"""Ten housings of one's own by the product and by CalculiX: the table of docs/your-own-part.md.

CalculiX solves 20-node elements with full integration, where the product has reduced, on a finer section in three
layers for each half. Of the housing as it is designed, both ways differ by 0.1 % there.

    python -m benchmarks.own_parts [NAME ...]
"""

import argparse
import sys
import time

from benchmarks.flexure import E_MPA, HOUSING, POISSON, peer_stiffness
from benchmarks.harness import table
from benchmarks.own_housings import OWN_HOUSINGS
from cad.checks.own_part import as_one_shape, extrusion_of, faces_at, hole_points, own_part, own_solid, tip_points
from mesh.own_part import swept_part
from pipeline.springs.own_part import HELD, stiffness
from solve.housing.stiffness import tip_face

FINER = (2.0, 3)  # scale of the section, layers of a half
FULL = ("hex 20, full", "C3D20")
PEER_ERROR = 1e-3  # of full against reduced integration on this mesh
HEADS = [
    "housing",
    "K_l [N/m]",
    "CalculiX",
    "K_h [N/m]",
    "CalculiX",
    "inside both bars",
    "unknowns",
    "CPU s",
    "CalculiX",
]


def row_of(name: str) -> list[str]:
    """Return the row of one housing."""
    shape = OWN_HOUSINGS[name]()
    start = time.process_time()
    found = stiffness(shape, held=hole_points(HOUSING), pressed=tip_points(HOUSING), E_MPa=E_MPA, poisson=POISSON)
    cpu = time.process_time() - start
    solid = own_solid(as_one_shape(shape), name)
    faces = {tip_face(tip): faces_at(solid, tip, [point]) for tip, point in tip_points(HOUSING).items()}
    faces[HELD] = faces_at(solid, "held", hole_points(HOUSING))
    extrusion = extrusion_of(own_part(solid, faces))
    if extrusion is None:
        return [name, "no extrusion", "", "", "", "", "", "", ""]
    peer = peer_stiffness(swept_part(extrusion, *FINER).mesh, FULL, (E_MPA, POISSON))
    cells = []
    is_inside = True
    for face, K in zip(found.faces.values(), peer.values, strict=True):
        cells += [f"{1e3 * face.K:.1f} ± {100.0 * face.K_error:.2f} %", f"{1e3 * K:.1f}"]
        is_inside &= abs(face.K - K) <= face.K * face.K_error + PEER_ERROR * K
    return [name, *cells, "yes" if is_inside else "no", str(found.dofs), f"{cpu:.0f}", f"{peer.cpu:.0f}"]


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(OWN_HOUSINGS))
    rows = []
    for name in parser.parse_args().names:
        rows.append(row_of(name))
        print(rows[-1], file=sys.stderr, flush=True)
    print(table(HEADS, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())

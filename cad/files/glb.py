"""Coloured bodies as GLB, the binary form of glTF 2.0, which browsers show: ISO/IEC 12113."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from sensor.arrays import Floats

Tree = dict[str, Any]  # JSON of glTF while it is put together

MOTION = "motion"
"""Name of the one animation, of one second, in which every body moves from where it is."""

_MATERIAL = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.7}, "doubleSided": True}
_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # glTF has y up: (x, z, -y)
_METRE = 1e-3  # glTF counts in metres
_FLOAT = 5126
_MOVED = "_moved"
_TOE = 0.04045  # below, colours of a screen are linear


@dataclass(frozen=True, kw_only=True, eq=False)
class GlbBody:
    """A body: its name, vertices (n, 3) [mm], triangles (m, 3), and what the animation moves it by.

    `colour` (red, green, blue from 0 to 1) and `moved` [mm] are one for the whole body, (3,), or one for each vertex,
    (n, 3).
    """

    name: str
    vertices: Floats
    triangles: NDArray[np.int64]
    colour: Floats
    moved: Floats


def glb_position(points: Floats) -> Floats:
    """Return points (..., 3) [mm], z up, as glTF has them [m]."""
    return np.asarray(_METRE * (points @ _UP.T))


def glb_of(bodies: Sequence[GlbBody]) -> bytes:
    """Return bodies as the bytes of a GLB file.

    What moves a body is a morph target of its mesh. trimesh writes no such targets: it is given them as an attribute of
    the vertices, and `_with_targets` makes targets of those.
    """
    scene: Any = trimesh.Scene()  # its methods have no types that strict mode takes
    for body in bodies:
        count = len(body.vertices)
        mesh = trimesh.Trimesh(
            vertices=glb_position(body.vertices),
            faces=body.triangles,
            vertex_colors=np.broadcast_to(_linear(body.colour), (count, 3)),
            process=False,
        )
        moved = glb_position(np.broadcast_to(body.moved, (count, 3)))
        mesh.vertex_attributes[_MOVED] = moved.astype(np.float32)
        scene.add_geometry(mesh, node_name=body.name, geom_name=body.name)
    return bytes(scene.export(file_type="glb", tree_postprocessor=_with_targets, buffer_postprocessor=_with_motion))


def _linear(colour: Floats) -> NDArray[np.uint8]:
    """Return colours of a screen as linear ones from 0 to 255, which vertices of glTF have: IEC 61966-2-1."""
    linear = np.where(colour <= _TOE, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * linear).astype(np.uint8)


def _with_motion(buffers: Any, tree: Tree) -> None:  # noqa: ANN401 - an ordered mapping of trimesh
    """Add the animation: the weight of each body's target goes from 0 to 1 in one second.

    The same numbers, 0 and 1, are the times [s] and the weights at them. They become one more buffer, which an accessor
    describes; both are called by their number in glTF.
    """
    ramp = np.array([0.0, 1.0], dtype=np.float32)
    buffer_number = len(buffers)
    buffers[MOTION] = ramp.tobytes()
    accessor_number = len(tree["accessors"])
    tree["accessors"][MOTION] = {
        "bufferView": buffer_number,
        "componentType": _FLOAT,
        "count": len(ramp),
        "type": "SCALAR",
        "min": [0.0],
        "max": [1.0],
    }
    nodes = [index for index, node in enumerate(tree["nodes"]) if "mesh" in node]
    tree["animations"] = [
        {
            "name": MOTION,
            "samplers": [{"input": accessor_number, "output": accessor_number, "interpolation": "LINEAR"}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": "weights"}} for node in nodes],
        }
    ]


def _with_targets(tree: Tree) -> None:
    """Make what each body is moved by a target of its shape, and give all the one material."""
    tree["materials"] = [_MATERIAL]
    for mesh in tree["meshes"]:
        mesh["weights"] = [0.0]
        for primitive in mesh["primitives"]:
            primitive["material"] = 0
            primitive["targets"] = [{"POSITION": primitive["attributes"].pop(_MOVED)}]

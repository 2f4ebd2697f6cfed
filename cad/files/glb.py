"""Coloured bodies in GLB files for browsers. GLB is the binary form of glTF 2.0, ISO/IEC 12113."""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensor.arrays import Floats

Tree = dict[str, Any]  # a part of the JSON data in a glTF file

MOTION = "motion"
"""The name of the animation, which moves every body to its position in the exploded view within one second."""

_MATERIAL = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.7}, "doubleSided": True}
_TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # glTF has y up: (x, y, z) becomes (x, z, -y)
_M_PER_MM = 1e-3  # glTF is in metres
_COMPONENT_TYPES = {"<f4": 5126, "<u4": 5125, "|u1": 5121}  # glTF's code of each NumPy data type
_LINEAR_LIMIT = 0.04045  # up to this value, sRGB is proportional to linear colour
_HEADER_BYTES = 12  # size of the file header: the magic bytes, the version, and the size of the file


@dataclass(frozen=True, kw_only=True, eq=False)
class GlbBody:
    """A body: its name, vertices (n, 3) [mm], triangles (m, 3), colour, and displacement [mm] in the animation.

    `triangles` are the vertex indices of the corners. `colour` holds red, green and blue from 0 to 1. Colour and
    displacement are given for the whole body, shape (3,), or for each vertex, shape (n, 3).
    """

    name: str
    vertices: Floats
    triangles: NDArray[np.int64]
    colour: Floats
    displacement: Floats


def glb_position(points: Floats) -> Floats:
    """Convert points (..., 3) from millimetres with z up to glTF coordinates, which are metres with y up."""
    return np.asarray(_M_PER_MM * (points @ _TO_Y_UP.T))


def encode_glb(bodies: Sequence[GlbBody]) -> bytes:
    """Return the bytes of a GLB file with these bodies.

    The displacement of a body is a morph target of its mesh. The animation raises the weights of all morph targets from
    0 to 1 within one second. Each body has one mesh and one node, which have the index of the body.
    """
    arrays = _Arrays()
    meshes = [_add_mesh(body, arrays) for body in bodies]
    ramp = arrays.add(np.array([[0.0], [1.0]], dtype="<f4"), "SCALAR")  # used both as times [s] and as weights
    indices = range(len(bodies))
    animation = {
        "name": MOTION,
        "samplers": [{"input": ramp, "output": ramp, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": node, "path": "weights"}} for node in indices],
    }
    buffer = b"".join(arrays.chunks)
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(indices)}],
        "nodes": [{"name": body.name, "mesh": index} for index, body in enumerate(bodies)],
        "meshes": meshes,
        "materials": [_MATERIAL],
        "animations": [animation],
        "accessors": arrays.accessors,
        "bufferViews": arrays.views,
        "buffers": [{"byteLength": len(buffer)}],
    }
    return _glb_file(tree, buffer)


def _glb_file(tree: Tree, buffer: bytes) -> bytes:
    """Return a GLB file: a header, a chunk with the JSON data in `tree`, and a chunk with the binary buffer."""
    json_chunk = json.dumps(tree, separators=(",", ":")).encode()
    # The length of a chunk must be a multiple of four bytes. The buffer always has such a length.
    json_chunk += b" " * (-len(json_chunk) % 4)
    # Each chunk begins with its length and its type.
    json_head = struct.pack("<I4s", len(json_chunk), b"JSON")
    buffer_head = struct.pack("<I4s", len(buffer), b"BIN\0")
    chunks = json_head + json_chunk + buffer_head + buffer
    return struct.pack("<4sII", b"glTF", 2, _HEADER_BYTES + len(chunks)) + chunks  # 2 is the version of glTF


class _Arrays:
    """The arrays of a GLB file: their bytes, their positions in the buffer (views), and their types (accessors)."""

    def __init__(self) -> None:
        self.chunks: list[bytes] = []
        self.views: list[Tree] = []
        self.accessors: list[Tree] = []
        self._length = 0  # current length of the buffer [bytes]

    def add(self, array: NDArray[Any], row_type: str, **properties: object) -> int:
        """Append an array (n, m) to the buffer, and return the index of its accessor.

        The size of a row must be a multiple of four bytes, because glTF aligns arrays to four bytes. `row_type` is the
        glTF type of a row, such as VEC3. `properties` are further properties of the accessor, such as `normalized`.
        """
        chunk = array.tobytes()
        accessor = {
            "bufferView": len(self.views),
            "componentType": _COMPONENT_TYPES[array.dtype.str],
            "count": len(array),
            "type": row_type,
            "min": array.min(axis=0).tolist(),
            "max": array.max(axis=0).tolist(),
        }
        self.views.append({"buffer": 0, "byteOffset": self._length, "byteLength": len(chunk)})
        self.accessors.append(accessor | properties)
        self.chunks.append(chunk)
        self._length += len(chunk)
        return len(self.accessors) - 1


def _add_mesh(body: GlbBody, arrays: _Arrays) -> Tree:
    """Add the arrays of a body to `arrays`, and return the glTF mesh that refers to them by the indices of accessors.

    The displacement of the body is the morph target of the mesh. The weight of the morph target is 0 until the
    animation raises it.
    """
    vertex_count = len(body.vertices)
    colour = np.full((vertex_count, 4), 255, dtype=np.uint8)  # the fourth channel is opacity
    colour[:, :3] = _linear_colour(body.colour)
    displacement = np.broadcast_to(body.displacement, (vertex_count, 3))
    primitive = {
        "attributes": {
            "POSITION": arrays.add(glb_position(body.vertices).astype("<f4"), "VEC3"),
            "COLOR_0": arrays.add(colour, "VEC4", normalized=True),
        },
        "indices": arrays.add(body.triangles.reshape(-1, 1).astype("<u4"), "SCALAR"),
        "targets": [{"POSITION": arrays.add(glb_position(displacement).astype("<f4"), "VEC3")}],
        "material": 0,  # the index of the only material
    }
    return {"name": body.name, "primitives": [primitive], "weights": [0.0]}


def _linear_colour(colour: Floats) -> NDArray[np.uint8]:
    """Convert sRGB colours (IEC 61966-2-1) to linear colours from 0 to 255, which glTF requires for vertices.

    The sRGB colours are numbers from 0 to 1.
    """
    # The constants of the two branches are from the standard.
    linear = np.where(colour <= _LINEAR_LIMIT, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * linear).astype(np.uint8)

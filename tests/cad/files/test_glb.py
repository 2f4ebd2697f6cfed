"""A GLB file has every body where it is, y up and in metres, in its colour, and moves it as it is told."""

import io
import json

import numpy as np
import pytest
import trimesh

from cad.files.glb import MOTION, GlbBody, encode_glb, glb_position

CORNERS = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 30.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def body(name, **changes):
    given = {"vertices": CORNERS, "triangles": FACES, "colour": np.array([1.0, 0.5, 0.0]), "displacement": np.zeros(3)}
    return GlbBody(name=name, **{**given, **changes})


def tree_of(glb):
    """Return the JSON of a GLB, which follows its header of 12 bytes, and the bytes of its buffer."""
    length = int.from_bytes(glb[12:16], "little")
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


def values(tree, buffer, accessor, width):
    one = tree["accessors"][accessor]
    start = tree["bufferViews"][one["bufferView"]]["byteOffset"]
    return np.frombuffer(buffer, "<f4", one["count"] * width, start).reshape(-1, width)


def test_bodies_are_read_back_with_names_and_places():
    shifted = CORNERS + np.array([0.0, 0.0, 5.0])
    scene = trimesh.load(io.BytesIO(encode_glb([body("one"), body("two", vertices=shifted)])), file_type="glb")
    assert set(scene.geometry) == {"one", "two"}
    for name, vertices in (("one", CORNERS), ("two", shifted)):
        mesh = scene.geometry[name]
        assert mesh.volume == pytest.approx(10.0 * 20.0 * 30.0 / 6.0 * 1e-9, rel=1e-6)  # [m^3]
        # z up becomes y up: (x, y, z) is at (x, z, -y)
        expected = 1e-3 * np.stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]], axis=1)
        np.testing.assert_allclose(mesh.vertices, expected, atol=1e-9)
        np.testing.assert_allclose(glb_position(vertices), expected)


def test_animation_moves_each_vertex():
    displacement = np.arange(12.0).reshape(4, 3)
    tree, buffer = tree_of(encode_glb([body("still"), body("moving", displacement=displacement)]))
    (animation,) = tree["animations"]
    assert animation["name"] == MOTION
    moving = [tree["nodes"][channel["target"]["node"]]["name"] for channel in animation["channels"]]
    assert moving == ["still", "moving"]
    assert {channel["target"]["path"] for channel in animation["channels"]} == {"weights"}
    (sampler,) = animation["samplers"]
    assert values(tree, buffer, sampler["input"], 1).ravel().tolist() == [0.0, 1.0]
    for mesh, expected in zip(tree["meshes"], (np.zeros(3), displacement), strict=True):
        (primitive,) = mesh["primitives"]
        (target,) = primitive["targets"]
        found = values(tree, buffer, target["POSITION"], 3)
        np.testing.assert_allclose(found, glb_position(np.broadcast_to(expected, (4, 3))), atol=1e-9)


def test_colours_are_linear_as_glTF_asks():
    """SRGB 0.5 is 0.2140 in linear light: IEC 61966-2-1."""
    tree, buffer = tree_of(encode_glb([body("one")]))
    accessor = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]]
    start = tree["bufferViews"][accessor["bufferView"]]["byteOffset"]
    assert list(buffer[start : start + 4]) == [255, round(0.2140 * 255), 0, 255]

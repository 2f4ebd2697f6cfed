"""A solid together with the names of the faces that matter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq


@dataclass(frozen=True, kw_only=True)
class Part:
    """A valid solid [mm] and its named faces; a face name travels on as gmsh group, mesh boundary and load case.

    Faces are held by their place in `shape.Faces()`: that order survives a BREP file, names do not.
    """

    name: str
    shape: cq.Shape
    faces: Mapping[str, tuple[int, ...]]

    def face_area(self, name: str) -> float:
        """Return the area of a named face [mm^2]; raises KeyError that lists the known names."""
        if name not in self.faces:
            msg = f"face {name!r} is unknown on part {self.name!r}; known faces: {', '.join(self.faces)}"
            raise KeyError(msg)
        every = self.shape.Faces()
        return sum(every[index].Area() for index in self.faces[name])

    def write_brep(self, path: Path) -> None:
        """Write the solid as a BREP file [mm], which keeps the order of the faces; raises OSError when it cannot."""
        if not self.shape.exportBrep(str(path)):
            msg = f"part {self.name!r}: cannot write {path}; check that the folder exists and has room"
            raise OSError(msg)


def named_part(name: str, shape: cq.Shape, faces: Mapping[str, Callable[[cq.Face], bool]]) -> Part:
    """Return a part whose named faces are those that a test on each face picks.

    Raises ValueError when a name matches no face, or when two names match the same face.
    """
    every = shape.Faces()
    picked: dict[str, tuple[int, ...]] = {}
    owner: dict[int, str] = {}
    for face_name, belongs in faces.items():
        indices = tuple(i for i, face in enumerate(every) if belongs(face))
        if not indices:
            msg = f"part {name!r}: the name {face_name!r} matches no face; known names: {', '.join(faces)}"
            raise ValueError(msg)
        for i in indices:
            if i in owner:
                msg = f"part {name!r}: face {i} is named both {owner[i]!r} and {face_name!r}"
                raise ValueError(msg)
            owner[i] = face_name
        picked[face_name] = indices
    return Part(name=name, shape=shape, faces=picked)

"""STEP files (AP242, millimetres, named and coloured parts) whose bytes depend on nothing but the bodies.

OCCT puts the time, a count of what the process wrote before and an order by memory address into the text:
the header is set, counts are taken again, and the entities are put in an order that the content gives.
"""

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from graphlib import TopologicalSorter
from pathlib import Path

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from cad.files.file_date import file_date
from cad.kernel import cq
from cad.parts.sensor import Body

_LINE = 78
_YES, _NO = True, False
_ENTITY = re.compile(r"#(\d+)\s*=\s*((?:[^';]|'(?:[^']|'')*')*);")
_STRING = re.compile(r"('(?:[^']|'')*')")
_STRING_OR_SPACE = re.compile(r"('(?:[^']|'')*')|\s+")
_PIECE = re.compile(r"'(?:[^']|'')*'|[^',]+|,")
_REFERENCE = re.compile(r"#(\d+)")
_COUNTED_START = "NEXT_ASSEMBLY_USAGE_OCCURRENCE('"
_COUNTED = re.compile(r"^(NEXT_ASSEMBLY_USAGE_OCCURRENCE\(')[^']*(')")
_TRANSLATOR = re.compile(r"(Open CASCADE STEP translator [\d.]+) [\d.]+")
_UNORDERED = re.compile(r"^(MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION\('[^']*',\()([#\d,]*)(\).*)$")


def write_step(bodies: Sequence[Body], path: Path, name: str) -> None:
    """Write bodies [mm] to a STEP file; several become an assembly of the given name; raises OSError.

    The header's time is `file_date`.
    """
    writer = STEPCAFControl_Writer()
    for key, value in (("write.step.schema", "AP242DIS"), ("write.step.unit", "MM"), ("xstep.cascade.unit", "MM")):
        Interface_Static.SetCVal_s(key, value)
    writer.SetColorMode(_YES)
    writer.SetNameMode(_YES)
    writer.Transfer(_document(bodies, name), STEPControl_AsIs)
    _set_header(writer, name)
    if writer.Write(str(path)) != IFSelect_RetDone:
        msg = f"STEP: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)
    path.write_text(canonical(path.read_text(encoding="ascii")), encoding="ascii")


def read_step(path: Path) -> cq.Shape:
    """Return the shape of a STEP file [mm]; raises ValueError when it holds none that can be read."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()  # OCCT prints what it meets; the caller gets it as an error
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone or not reader.TransferRoots():
        msg = f"STEP: {path.name} holds no shape that can be read; export it again"
        raise ValueError(msg)
    return cq.Shape.cast(reader.OneShape())


def _document(bodies: Sequence[Body], name: str) -> TDocStd_Document:
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    labels = []
    for body in bodies:
        label = shapes.AddShape(body.shape.wrapped, _NO)
        _name(label, body.name)
        colours.SetColor(label, Quantity_Color(*body.colour, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        labels.append((label, body.name))
    if len(labels) > 1:
        assembly = shapes.NewShape()
        _name(assembly, name)
        for label, part in labels:
            _name(shapes.AddComponent(assembly, label, TopLoc_Location()), part)
        shapes.UpdateAssemblies()
    return document


def _name(label: TDF_Label, name: str) -> None:
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))


def _set_header(writer: STEPCAFControl_Writer, name: str) -> None:
    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(TCollection_HAsciiString(name))
    header.SetTimeStamp(TCollection_HAsciiString(file_date().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetAuthorValue(1, TCollection_HAsciiString("twintip"))
    header.SetOrganizationValue(1, TCollection_HAsciiString(""))
    header.SetOriginatingSystem(TCollection_HAsciiString("twintip"))


def canonical(text: str) -> str:
    """Return Part 21 text with the same content in an order and with numbers that only the content decides."""
    head, mark, rest = text.partition("DATA;")
    data, end, tail = rest.partition("ENDSEC;\nEND-ISO")
    if not (mark and end):
        msg = "STEP: the text has no DATA section; write the file again"
        raise ValueError(msg)
    lines = _canonical_lines({int(number): _plain(body) for number, body in _ENTITY.findall(data)})
    return f"{head}{mark}\n" + "\n".join(lines) + f"\n{end}{tail}"


def _canonical_lines(entities: dict[int, str]) -> list[str]:
    """Return the entities, their unordered items sorted, in the order and with the numbers of their content."""
    digest: dict[int, str] = {}
    for number in TopologicalSorter(_references(entities)).static_order():
        entities[number] = _sorted_items(entities[number], digest)
        digest[number] = hashlib.sha256(_renamed(entities[number], digest).encode("ascii")).hexdigest()
    uses = _references(entities)
    used = {number for numbers in uses.values() for number in numbers}
    roots = sorted(entities.keys() - used, key=digest.__getitem__)
    place = {number: count for count, number in enumerate(_from_roots(roots, uses), start=1)}
    return [_lines(count, _renamed(entities[number], place)) for number, count in place.items()]


def _plain(body: str) -> str:
    """Return an entity without line breaks and without what a process counts."""
    if "'" not in body:
        return "".join(body.split())
    joined = _STRING_OR_SPACE.sub(lambda match: (match[1] or "").replace("\n", ""), body)
    return _COUNTED.sub(r"\1\2", _TRANSLATOR.sub(r"\1", joined))


def _references(entities: Mapping[int, str]) -> dict[int, list[int]]:
    """Return by entity the numbers of those that it refers to, in the order of its text, strings left out."""
    return {number: [int(n) for n in _REFERENCE.findall(_STRING.sub("''", body))] for number, body in entities.items()}


def _sorted_items(body: str, digest: Mapping[int, str]) -> str:
    """Return the entity with its items sorted by content, where OCCT orders them by address."""
    match = _UNORDERED.match(body)
    if match is None:
        return body
    items = sorted((int(n) for n in _REFERENCE.findall(match[2])), key=digest.__getitem__)
    return match[1] + ",".join(f"#{n}" for n in items) + match[3]


def _from_roots(roots: Sequence[int], uses: dict[int, list[int]]) -> Iterator[int]:
    """Yield every entity once, each root followed by what it refers to, in the order of the text."""
    seen: set[int] = set()
    waiting = list(reversed(roots))
    while waiting:
        number = waiting.pop()
        if number not in seen:
            seen.add(number)
            yield number
            waiting += reversed(uses[number])


def _renamed(body: str, names: Mapping[int, object]) -> str:
    """Return the entity with its references, but not its strings, written with other names."""

    def renamed(reference: re.Match[str]) -> str:
        return f"#{names[int(reference[1])]}"

    parts = enumerate(_STRING.split(body))
    return "".join(part if i % 2 else _REFERENCE.sub(renamed, part) for i, part in parts)


def _lines(number: int, body: str) -> str:
    """Return one entity, broken after commas so that no line grows long; counted anew where it carries a count."""
    if body.startswith(_COUNTED_START):
        body = f"{_COUNTED_START}{number}{body.removeprefix(_COUNTED_START)}"
    lines, line = [], f"#{number} = "
    for piece in _PIECE.findall(f"{body};") if len(body) > _LINE - len(line) else (f"{body};",):
        if len(line) + len(piece) > _LINE and line.strip() and piece != ",":
            lines.append(line)
            line = ""
        line += piece
    return "\n".join([*lines, line])

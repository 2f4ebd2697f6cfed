"""STEP files (AP242, millimetres, named and coloured parts) whose bytes depend on nothing but the bodies.

OCCT puts the time, a count of what the process wrote before and an order by memory address into the text:
the header is set, counts are taken again, and the entities are put in an order that the content gives.
"""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import cadquery as cq
import OCP

from cad.files.file_date import file_date
from cad.parts.sensor import Body

_LINE = 78
_YES, _NO = True, False
_STRING = re.compile(r"'(?:[^']|'')*'")
_ENTITY = re.compile(r"#(\d+)=([^;]*);")
_REFERENCE = re.compile(r"#(\d+)")
_ASIDE = re.compile(r"\0(\d+)\0")
_PIECE = re.compile(r"'(?:[^']|'')*'|[^',]+|,")
_COUNTED_START = "NEXT_ASSEMBLY_USAGE_OCCURRENCE('"
_COUNTED = re.compile(r"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\()\0\d+\0")
_TRANSLATOR = re.compile(r"(Open CASCADE STEP translator [\d.]+) [\d.]+")
_UNORDERED = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION("
_Entities = dict[str, list[str]]
"""The text of each entity by its number, split at its references: text, number, text, number, ..., text."""


def write_step(bodies: Sequence[Body], path: Path, name: str) -> None:
    """Write bodies [mm] to a STEP file; several become an assembly of the given name; raises OSError.

    The header's time is `file_date`.
    """
    writer = OCP.STEPCAFControl.STEPCAFControl_Writer()
    for key, value in (("write.step.schema", "AP242DIS"), ("write.step.unit", "MM"), ("xstep.cascade.unit", "MM")):
        OCP.Interface.Interface_Static.SetCVal_s(key, value)
    writer.SetColorMode(_YES)
    writer.SetNameMode(_YES)
    writer.Transfer(_document(bodies, name), OCP.STEPControl.STEPControl_AsIs)
    _set_header(writer, name)
    if writer.Write(str(path)) != OCP.IFSelect.IFSelect_RetDone:
        msg = f"STEP: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)
    path.write_text(canonical(path.read_text(encoding="ascii")), encoding="ascii")


def read_step(path: Path) -> cq.Shape:
    """Return the shape of a STEP file [mm]; raises ValueError when it holds none that can be read."""
    # OCCT prints what it meets; the caller gets it as an error.
    OCP.Message.Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = OCP.STEPControl.STEPControl_Reader()
    if reader.ReadFile(str(path)) != OCP.IFSelect.IFSelect_RetDone or not reader.TransferRoots():
        msg = f"STEP: {path.name} holds no shape that can be read; export it again"
        raise ValueError(msg)
    return cq.Shape.cast(reader.OneShape())


def _document(bodies: Sequence[Body], name: str) -> OCP.TDocStd.TDocStd_Document:
    document = OCP.TDocStd.TDocStd_Document(OCP.TCollection.TCollection_ExtendedString("XmlOcaf"))
    shapes = OCP.XCAFDoc.XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = OCP.XCAFDoc.XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    labels = []
    for body in bodies:
        label = shapes.AddShape(body.shape.wrapped, _NO)
        _name(label, body.name)
        colours.SetColor(
            label,
            OCP.Quantity.Quantity_Color(*body.colour, OCP.Quantity.Quantity_TOC_sRGB),
            OCP.XCAFDoc.XCAFDoc_ColorSurf,
        )
        labels.append((label, body.name))
    if len(labels) > 1:
        assembly = shapes.NewShape()
        _name(assembly, name)
        for label, part in labels:
            _name(shapes.AddComponent(assembly, label, OCP.TopLoc.TopLoc_Location()), part)
        shapes.UpdateAssemblies()
    return document


def _name(label: OCP.TDF.TDF_Label, name: str) -> None:
    OCP.TDataStd.TDataStd_Name.Set_s(label, OCP.TCollection.TCollection_ExtendedString(name))


def _set_header(writer: OCP.STEPCAFControl.STEPCAFControl_Writer, name: str) -> None:
    header = OCP.APIHeaderSection.APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(OCP.TCollection.TCollection_HAsciiString(name))
    header.SetTimeStamp(OCP.TCollection.TCollection_HAsciiString(file_date().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetAuthorValue(1, OCP.TCollection.TCollection_HAsciiString("twintip"))
    header.SetOrganizationValue(1, OCP.TCollection.TCollection_HAsciiString(""))
    header.SetOriginatingSystem(OCP.TCollection.TCollection_HAsciiString("twintip"))


def canonical(text: str) -> str:
    """Return Part 21 text with the same content in an order and with numbers that only the content decides."""
    head, mark, rest = text.partition("DATA;")
    data, end, tail = rest.partition("ENDSEC;\nEND-ISO")
    if not (mark and end):
        msg = "STEP: the text has no DATA section; write the file again"
        raise ValueError(msg)
    entities = _entities(data)
    roots = _sort_roots(entities)
    place = {number: f"#{count}" for count, number in enumerate(_from_roots(roots, entities), start=1)}
    lines = [_lines(name, _renamed(entities[number], place)) for number, name in place.items()]
    return f"{head}{mark}\n" + "\n".join(lines) + f"\n{end}{tail}"


def _entities(data: str) -> _Entities:
    """Return the entities without line breaks and without what a process counts.

    Strings are set aside meanwhile, for in them spaces and signs mean nothing.
    """
    strings: list[str] = []

    def aside(match: re.Match[str]) -> str:
        if match[0] == "''":
            return "''"
        strings.append(_TRANSLATOR.sub(r"\1", match[0].replace("\n", "")))
        return f"\0{len(strings) - 1}\0"

    def in_place(match: re.Match[str]) -> str:
        return strings[int(match[1])]

    bare = _COUNTED.sub(r"\1''", "".join(_STRING.sub(aside, data).split()))
    entities = {}
    for number, body in _ENTITY.findall(bare):
        pieces = _REFERENCE.split(body)
        entities[number] = [_ASIDE.sub(in_place, piece) for piece in pieces] if "\0" in body else pieces
    return entities


def _sort_roots(entities: _Entities) -> list[str]:
    """Return in the order of their content the entities that none refers to; sort in place what OCCT leaves unordered.

    Entities of equal content are told apart by what refers to them. Where that too is equal, they can change
    places, so either may come first; what belongs to them then follows that choice.
    """
    used = {number for pieces in entities.values() for number in pieces[1::2]}
    roots = [number for number in entities if number not in used]
    lists = [pieces for pieces in entities.values() if pieces[0].startswith(_UNORDERED)]
    items = [number for pieces in lists for number in pieces[1 : _end_of_items(pieces) : 2]]
    content = digest = _digests(entities, {})
    while tied := _tied(dict.fromkeys(roots + items), digest):
        finer = _digests(entities, _surroundings(entities, digest))
        if len(set(finer.values())) == len(set(digest.values())):
            finer = _digests(entities, {**digest, tied: f"first {digest[tied]}"})
        digest = finer
    order = {number: content[number] + digest[number] for number in entities}
    for pieces in lists:
        _sort_items(pieces, order)
    return sorted(roots, key=order.__getitem__)


def _tied(numbers: Iterable[str], digest: Mapping[str, str]) -> str | None:
    """Return one of those entities that share the least digest which more than one has, if any does."""
    count = Counter(digest[number] for number in numbers)
    return min((number for number in numbers if count[digest[number]] > 1), key=digest.__getitem__, default=None)


def _surroundings(entities: _Entities, digest: Mapping[str, str]) -> dict[str, str]:
    """Return by number the digest of an entity with those of all that refer to it, and at which place they do."""
    found: dict[str, list[str]] = {number: [] for number in entities}
    for user, pieces in entities.items():
        unordered = pieces[0].startswith(_UNORDERED)
        for place, number in enumerate(pieces[1::2]):
            found[number].append(digest[user] if unordered else f"{digest[user]} {place}")
    return {number: " ".join([digest[number], *sorted(users)]) for number, users in found.items()}


def _digests(entities: _Entities, marks: Mapping[str, str]) -> dict[str, str]:
    """Return by number a digest of an entity's mark, of what it says, and of what it refers to.

    Where OCCT orders items by address, they are put in the order of their digests. Raises ValueError for a circle.
    """
    digest: dict[str, str] = {}
    waiting, opened = list(entities), set()
    while waiting:
        number = waiting.pop()
        if number in digest:
            continue
        pieces = entities[number]
        unknown = [used for used in pieces[1::2] if used not in digest]
        if unknown and number in opened:
            msg = f"STEP: entity #{number} refers to itself; write the file again"
            raise ValueError(msg)
        if unknown:
            opened.add(number)
            waiting += [number, *unknown]
            continue
        if pieces[0].startswith(_UNORDERED):
            _sort_items(pieces, digest)
        text = marks.get(number, "") + _renamed(pieces, digest)
        digest[number] = "#" + hashlib.sha256(text.encode("ascii")).hexdigest()
    return digest


def _sort_items(pieces: list[str], digest: Mapping[str, str]) -> None:
    """Sort the first list of items of an entity by content."""
    end = _end_of_items(pieces)
    pieces[1:end:2] = sorted(pieces[1:end:2], key=digest.__getitem__)


def _end_of_items(pieces: list[str]) -> int:
    """Return the place of the text that ends the first list of items."""
    return next(i for i in range(2, len(pieces), 2) if pieces[i] != ",")


def _from_roots(roots: Sequence[str], entities: _Entities) -> Iterator[str]:
    """Yield every entity once, each root followed by what it refers to, in the order of the text."""
    seen: set[str] = set()
    waiting = list(reversed(roots))
    while waiting:
        number = waiting.pop()
        if number not in seen:
            seen.add(number)
            yield number
            waiting += entities[number][::-1][1::2]


def _renamed(pieces: list[str], names: Mapping[str, str]) -> str:
    """Return the text of an entity with its references written with other names."""
    named = pieces.copy()
    named[1::2] = [names[number] for number in pieces[1::2]]
    return "".join(named)


def _lines(name: str, body: str) -> str:
    """Return one entity, broken after commas so that no line grows long; counted anew where it carries a count."""
    if body.startswith(_COUNTED_START):
        body = f"{_COUNTED_START}{name[1:]}{body.removeprefix(_COUNTED_START)}"
    lines, line = [], f"{name} = "
    for piece in _PIECE.findall(f"{body};") if len(body) > _LINE - len(line) else (f"{body};",):
        if len(line) + len(piece) > _LINE and line.strip() and piece != ",":
            lines.append(line)
            line = ""
        line += piece
    return "\n".join([*lines, line])

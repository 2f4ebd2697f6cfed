"""STEP files (AP242, millimetres) of named and coloured bodies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cadquery as cq
import OCP

from cad.files.file_date import file_date
from cad.parts.sensor import NamedSolid

_STEP_SETTINGS = {"write.step.schema": "AP242DIS", "write.step.unit": "MM", "xstep.cascade.unit": "MM"}


def write_step(bodies: Sequence[NamedSolid], path: Path, name: str) -> None:
    """Write bodies [mm] to a STEP file dated `file_date`; several become an assembly of the name; raises OSError."""
    for key, value in _STEP_SETTINGS.items():
        OCP.Interface.Interface_Static.SetCVal_s(key, value)
    writer = OCP.STEPCAFControl.STEPCAFControl_Writer()
    writer.Transfer(_document(bodies, name), OCP.STEPControl.STEPControl_AsIs)
    header = OCP.APIHeaderSection.APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(_ascii(name))
    header.SetTimeStamp(_ascii(file_date().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetAuthorValue(1, _ascii("twintip"))
    header.SetOriginatingSystem(_ascii("twintip"))
    if writer.Write(str(path)) != OCP.IFSelect.IFSelect_RetDone:
        msg = f"STEP: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


def _document(bodies: Sequence[NamedSolid], name: str) -> OCP.TDocStd.TDocStd_Document:
    """Return OCCT's document of the bodies: one shape, or an assembly in which equal bodies are instances of one."""
    document = OCP.TDocStd.TDocStd_Document(_unicode("XmlOcaf"))
    shapes = OCP.XCAFDoc.XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = OCP.XCAFDoc.XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    assembly = shapes.NewShape() if len(bodies) > 1 else None
    for instances in by_shape(bodies):
        location = OCP.TopLoc.TopLoc_Location()
        shape = instances[0].shape.wrapped
        label = shapes.AddShape(shape.Located(location) if assembly else shape, makeAssembly=False)
        OCP.TDataStd.TDataStd_Name.Set_s(label, _unicode(_product_name([body.name for body in instances])))
        colour = OCP.Quantity.Quantity_Color(*instances[0].colour, OCP.Quantity.Quantity_TOC_sRGB)
        colours.SetColor(label, colour, OCP.XCAFDoc.XCAFDoc_ColorSurf)
        for body in instances if assembly else ():
            component = shapes.AddComponent(assembly, label, body.shape.wrapped.Location())
            OCP.TDataStd.TDataStd_Name.Set_s(component, _unicode(body.name))
    if assembly:
        OCP.TDataStd.TDataStd_Name.Set_s(assembly, _unicode(name))
        shapes.UpdateAssemblies()
    return document


def by_shape(bodies: Sequence[NamedSolid]) -> list[list[NamedSolid]]:
    """Return bodies in groups that have one shape, each in its place."""
    groups: list[list[NamedSolid]] = []
    for body in bodies:
        group = next((each for each in groups if each[0].shape.wrapped.IsPartner(body.shape.wrapped)), None)
        if group is None:
            groups.append([body])
        else:
            group.append(body)
    return groups


def _product_name(names: Sequence[str]) -> str:
    """Return the name of what several bodies are instances of: the words that all their names have, without numbers."""
    if len(names) == 1:
        return names[0]
    first, *others = [[word for word in name.split() if not word.isdecimal()] for name in names]
    common = [word for word in first if all(word in words for words in others)]
    return " ".join(common) or names[0]


def _unicode(text: str) -> OCP.TCollection.TCollection_ExtendedString:
    return OCP.TCollection.TCollection_ExtendedString(text)


def _ascii(text: str) -> OCP.TCollection.TCollection_HAsciiString:
    return OCP.TCollection.TCollection_HAsciiString(text)


def read_step(path: Path) -> cq.Shape:
    """Return the shape of a STEP file [mm]; raises ValueError when it holds none that can be read."""
    # OCCT prints what it meets; the caller gets it as an error.
    OCP.Message.Message.DefaultMessenger_s().ChangePrinters().Clear()
    reader = OCP.STEPControl.STEPControl_Reader()
    if reader.ReadFile(str(path)) != OCP.IFSelect.IFSelect_RetDone or not reader.TransferRoots():
        msg = f"STEP: {path.name} holds no shape that can be read; export it again"
        raise ValueError(msg)
    return cq.Shape.cast(reader.OneShape())

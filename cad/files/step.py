"""STEP files (AP242, millimetres) of named and coloured bodies."""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import cadquery as cq
import OCP

from cad.files.file_date import file_date
from cad.parts.sensor import NamedSolid
from sensor.machine_error import MachineError

_WRITING = {"write.step.schema": "AP242DIS", "write.step.unit": "MM", "xstep.cascade.unit": "MM"}
_READING = {"xstep.cascade.unit": "MM"}


def write_step(bodies: Sequence[NamedSolid], path: Path, name: str) -> None:
    """Write bodies [mm] to a STEP file dated `file_date`; several become an assembly of the name; raises OSError."""
    with _settings(_WRITING):
        writer = OCP.STEPCAFControl.STEPCAFControl_Writer()
        transferred = writer.Transfer(_document(bodies, name), OCP.STEPControl.STEPControl_AsIs)
    if not transferred:
        msg = f"STEP: the CAD kernel cannot translate the solids of {path}; check that there is free memory"
        raise MachineError(msg)
    model = writer.ChangeWriter().Model()
    _name_instances(model, [body.name for instances in by_shape(bodies) for body in instances])
    header = OCP.APIHeaderSection.APIHeaderSection_MakeHeader(model)
    header.SetName(_ascii(name))
    header.SetTimeStamp(_ascii(file_date().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetAuthorValue(1, _ascii("twintip"))
    header.SetOriginatingSystem(_ascii("twintip"))
    if writer.Write(str(path)) != OCP.IFSelect.IFSelect_RetDone:
        msg = f"STEP: cannot write {path}; check that the folder exists and has room"
        raise OSError(msg)


@contextmanager
def _settings(values: Mapping[str, str]) -> Iterator[None]:
    """Give OCCT's settings, which all of a process share, these values inside the block.

    They exist once a controller has been made. Raises MachineError for a setting or a value that OCCT does not know.
    """
    OCP.STEPCAFControl.STEPCAFControl_Controller.Init_s()
    before = {key: OCP.Interface.Interface_Static.CVal_s(key) for key in values}
    try:
        for key, value in values.items():
            if not OCP.Interface.Interface_Static.SetCVal_s(key, value):
                msg = f"STEP: OCCT does not take {value!r} for {key!r}; install the versions of requirements.lock"
                raise MachineError(msg)
        yield
    finally:
        for key, value in before.items():
            OCP.Interface.Interface_Static.SetCVal_s(key, value)


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


def _name_instances(model: OCP.StepData.StepData_StepModel, names: Sequence[str]) -> None:
    """Name the instances of an assembly in the order in which they were added; of one body there are none.

    OCCT names each for the first instance whose shape lies as it does. An instance that lies as its product was drawn
    lies as any of them, so that it would take the name of another, which is left without one.
    """
    entities = (model.Value(number + 1) for number in range(model.NbEntities()))
    kind = OCP.StepRepr.StepRepr_NextAssemblyUsageOccurrence
    instances = [entity for entity in entities if isinstance(entity, kind)]
    if instances:
        for instance, name in zip(instances, names, strict=True):
            instance.SetName(_ascii(name))


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
    """Return the shape of a STEP file [mm], which may begin with a byte order mark.

    Raises OSError for a file that cannot be read, ValueError for one that holds no shape.
    """
    with path.open("rb") as file:
        has_mark = file.read(len(codecs.BOM_UTF8)) == codecs.BOM_UTF8
        without_mark = io.BytesIO(file.read() if has_mark else b"")
    # OCCT prints what it meets; the caller gets it as an error.
    OCP.Message.Message.DefaultMessenger_s().ChangePrinters().Clear()
    with _settings(_READING):
        reader = OCP.STEPControl.STEPControl_Reader()
        status = reader.ReadStream(path.name, without_mark) if has_mark else reader.ReadFile(str(path))
        if status != OCP.IFSelect.IFSelect_RetDone or not reader.TransferRoots():
            msg = f"STEP: {path.name} holds no shape that can be read; export it again"
            raise ValueError(msg)
        return cq.Shape.cast(reader.OneShape())

"""STEP files (AP242, in millimetres) of assemblies and parts, with names and colours."""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import cadquery as cq
import OCP

from cad.files.file_date import file_date
from cad.parts.assembly import part_type
from sensor.machine_error import MachineError

_WRITING = {"write.step.schema": "AP242DIS", "write.step.unit": "MM", "xstep.cascade.unit": "MM"}
_READING = {"xstep.cascade.unit": "MM"}


def write_step(assembly: cq.Assembly, path: Path) -> None:
    """Write an assembly or a single part [mm] to a STEP file, with names and colours, dated by `file_date`.

    Raises OSError if the file cannot be written, and MachineError if OCCT cannot translate the solids.
    """
    with _occt_settings(_WRITING):
        writer = OCP.STEPCAFControl.STEPCAFControl_Writer()
        transferred = writer.Transfer(_step_document(assembly), OCP.STEPControl.STEPControl_AsIs)
    if not transferred:
        msg = f"STEP: the CAD kernel cannot translate the solids of {path}; check that there is free memory"
        raise MachineError(msg)
    model = writer.ChangeWriter().Model()
    # OCCT names some instances wrongly, and writes the current time into the header.
    _name_instances(model, [part.name for part in _parts(assembly)])
    header = OCP.APIHeaderSection.APIHeaderSection_MakeHeader(model)
    header.SetName(_ascii(assembly.name))
    header.SetTimeStamp(_ascii(file_date().strftime("%Y-%m-%dT%H:%M:%S")))
    header.SetAuthorValue(1, _ascii("twintip"))  # the first author
    header.SetOriginatingSystem(_ascii("twintip"))
    if writer.Write(str(path)) != OCP.IFSelect.IFSelect_RetDone:
        msg = f"STEP: cannot write {path}. Check that the folder exists and the disk is not full."
        raise OSError(msg)


@contextmanager
def _occt_settings(values: Mapping[str, str]) -> Iterator[None]:
    """Change OCCT's settings, which are global in a process, inside a `with` block, and restore them afterwards.

    `values` are the temporary values, keyed by the names of the settings. Raises MachineError if OCCT does not know a
    setting or refuses its value.
    """
    # The settings do not exist until a controller has been initialised.
    OCP.STEPCAFControl.STEPCAFControl_Controller.Init_s()
    previous_values = {key: OCP.Interface.Interface_Static.CVal_s(key) for key in values}
    try:
        for key, value in values.items():
            if not OCP.Interface.Interface_Static.SetCVal_s(key, value):
                msg = f"STEP: OCCT refuses {value!r} for {key!r}; install the versions in requirements.lock"
                raise MachineError(msg)
        yield
    finally:
        for key, value in previous_values.items():
            OCP.Interface.Interface_Static.SetCVal_s(key, value)


def _step_document(assembly: cq.Assembly) -> OCP.TDocStd.TDocStd_Document:
    """Return an OCCT document that holds an assembly or a single part.

    The parts of an assembly are components of one label, `assembly_label`. Parts with the same shape refer to a common
    product, which has the name and the colour of the first of these parts.
    """
    document = OCP.TDocStd.TDocStd_Document(_unicode("XmlOcaf"))
    shapes = OCP.XCAFDoc.XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = OCP.XCAFDoc.XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    products: dict[cq.Shape, OCP.TDF.TDF_Label] = {}
    assembly_label = shapes.NewShape() if assembly.children else None  # None for a single part
    for part in _parts(assembly):
        shape = part.shapes[0]  # each part has one shape
        if shape not in products:
            products[shape] = shapes.AddShape(shape.wrapped, makeAssembly=False)
            OCP.TDataStd.TDataStd_Name.Set_s(products[shape], _unicode(part_type(part)))
            if part.color:
                colours.SetColor(products[shape], part.color.wrapped, OCP.XCAFDoc.XCAFDoc_ColorSurf)
        if assembly_label:
            shapes.AddComponent(assembly_label, products[shape], part.loc.wrapped)
    if assembly_label:
        OCP.TDataStd.TDataStd_Name.Set_s(assembly_label, _unicode(assembly.name))
        shapes.UpdateAssemblies()  # computes the shape of the assembly from its components
    return document


def _parts(assembly: cq.Assembly) -> Sequence[cq.Assembly]:
    """Return the parts of an assembly; a single part is returned in a list."""
    return assembly.children or [assembly]


def _name_instances(model: OCP.StepData.StepData_StepModel, names: Sequence[str]) -> None:
    """Name the instances of parts, in the order in which the parts were added.

    An assembly has instances, and so does a single part that was moved. OCCT itself looks up the name of an instance by
    its location. This look-up fails for instances that were not moved: some of their names are wrong or missing.
    """
    # OCCT numbers the entities of a file from 1.
    entities = (model.Value(number + 1) for number in range(model.NbEntities()))
    instance_type = OCP.StepRepr.StepRepr_NextAssemblyUsageOccurrence
    instances = [entity for entity in entities if isinstance(entity, instance_type)]
    if instances:
        for instance, name in zip(instances, names, strict=True):
            instance.SetName(_ascii(name))


def _unicode(text: str) -> OCP.TCollection.TCollection_ExtendedString:
    """Convert a text to OCCT's type for Unicode strings."""
    return OCP.TCollection.TCollection_ExtendedString(text)


def _ascii(text: str) -> OCP.TCollection.TCollection_HAsciiString:
    """Convert a text to OCCT's type for ASCII strings."""
    return OCP.TCollection.TCollection_HAsciiString(text)


def read_step(path: Path) -> cq.Shape:
    """Read the shape [mm] in a STEP file, which may begin with a byte order mark.

    Raises OSError if the file cannot be read, and ValueError if it holds no shape.
    """
    # OCCT cannot read a byte order mark. If the file has one, OCCT reads the data after it from a stream.
    with path.open("rb") as file:
        has_byte_order_mark = file.read(len(codecs.BOM_UTF8)) == codecs.BOM_UTF8
        data_after_mark = io.BytesIO(file.read() if has_byte_order_mark else b"")
    # OCCT must not print its messages to the terminal, because an error is raised instead.
    OCP.Message.Message.DefaultMessenger_s().ChangePrinters().Clear()
    with _occt_settings(_READING):
        reader = OCP.STEPControl.STEPControl_Reader()
        status = reader.ReadStream(path.name, data_after_mark) if has_byte_order_mark else reader.ReadFile(str(path))
        if status != OCP.IFSelect.IFSelect_RetDone or not reader.TransferRoots():
            msg = f"STEP: {path.name} holds no shape that can be read; export it again"
            raise ValueError(msg)
        return cq.Shape.cast(reader.OneShape())

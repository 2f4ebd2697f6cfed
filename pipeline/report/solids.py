"""The solids of a sensor: files of the part and of the part over its fruit, and the verdicts on their geometry."""

from pathlib import Path

from cad.design.design_file import design_as_mapping
from cad.design.parameters import Design
from cad.verdict import failed
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.storage.modeller.answer import Answer, known
from pipeline.storage.modeller.kept_files import Verdicts, kept_files
from pipeline.storage.modeller.modeller import Modeller

NO_LINE = failed(
    "geometry.layout",
    "pair or square",
    unit="1",
    reference="no housing is drawn for a line of three; its contact and response are those of the springs asked for",
)
_SHAPES = ("name", "fruit", "tips", "press")  # tables that solids and their checks depend on


def begin_solids(design: Design, springs: FittedSprings, folder: Path, modeller: Modeller) -> Answer[Verdicts]:
    """Let STEP, STL and 3MF be written into the folder; the answer is the geometry verdicts, none without a housing.

    A line of three has no housing, which fails geometry.layout.

    Files are the same bytes every time, so those of an earlier run are written again at once, which needs no modeller.
    The answer raises OSError or ExportError.
    """
    housing = springs.housing
    if design.tips.layout == "line":
        return known((NO_LINE,))
    if housing is None:
        return known(())
    inputs = {
        "design": {key: value for key, value in design_as_mapping(design).items() if key in _SHAPES},
        "housing": housing,
        "deflections": springs.deflections,
    }
    kept = kept_files("solids", inputs, folder)
    return modeller.ask("solids", inputs, design, housing, springs.deflections, folder) if kept is None else known(kept)

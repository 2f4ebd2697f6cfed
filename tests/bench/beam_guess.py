"""The housing of a design before any finite elements, which the scripts of this folder fit or judge."""

from cad.design.parameters import Design
from cad.design.printability import check_printable
from cad.design.processes import PROCESSES
from cad.parts.housing import Housing
from cad.parts.layout import housing_for
from cad.quantity import InputError
from pipeline.options import RunOptions
from pipeline.response.contact import contact_compliance
from pipeline.springs.sizing import spring_sizing


def beam_guess(design: Design) -> tuple[Housing, tuple[float, ...]]:
    """Return the housing with leaves as long as the beam law has them [mm], and the stiffnesses asked for [N/mm].

    Raises InputError with the reason where the process cannot make a spring, or where no housing fits.
    """
    process = PROCESSES[design.print.process]
    sizing = spring_sizing(design, contact_compliance(design.fruit, design.tips), RunOptions())
    verdicts = check_printable(design, sizing.springs, sizing.K_m_max_contact, process)
    for verdict in verdicts:
        if verdict.passed is False:
            raise InputError(verdict.reason)
    lengths = tuple(verdict.length_mm for verdict in verdicts)
    housing = housing_for(design, process, lengths, sizing.deflections(design.full_travels_mm))
    return housing, sizing.springs.stiffnesses

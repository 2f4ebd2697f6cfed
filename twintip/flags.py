"""The commands and their flags. This module is loaded for every help text, so it imports nothing slow.

A value in capitals in a help text is the placeholder of a flag's value. argparse formats help texts, so a percent sign
is written twice.
"""

from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pipeline.options import DEFAULT_DESIGN, DEFAULT_TOLERANCE, FRUIT_STIFFNESSES
from sensor.quantity import Bounds, parse_number, validation_error

DEFAULT_PROCESS = "fdm-petg"
BODIES = ("ball", "ellipsoid", "cylinder-end", "cylinder-side", "block")
SUPPORTS = ("plate", "table", "seat")
_MAX_RADII = 2  # number of principal radii of a curved surface


class Command(NamedTuple):
    """A command: the module that runs it, its purpose, an example, and the function that adds its flags."""

    module: str
    purpose: str
    example: str
    add_flags: Callable[[ArgumentParser], None]


def number(text: str) -> float:
    """Convert the text of a flag to a number. Raises ValueError unless the text is a number in a common notation."""
    value = parse_number(text)
    if value is None:
        raise ValueError(text)
    return value


def is_given(value: object) -> bool:
    """Return whether a flag with this parsed value was given; a flag left out has the value None, or False as a switch.

    The number 0 is a given value, although it equals False.
    """
    return value is not None and value is not False


def parse_radii(text: str, bounds: Bounds, bound: str, hint: str) -> tuple[float, float]:
    """Return the two principal radii [mm] that `text`, the value of `--radius`, holds; a single radius is used twice.

    An example of the text is "26,30". Raises InputError unless there are one or two numbers within `bounds`. The
    message of the error contains `bound`, the text that describes what is allowed, and `hint`.
    """
    parts = text.split(",")
    radii = [value for value in map(parse_number, parts) if value is not None]
    are_numbers = len(radii) == len(parts)
    is_one_or_two = len(radii) in (1, _MAX_RADII)
    if not are_numbers or not is_one_or_two or not all(map(bounds.hold, radii)):
        raise validation_error("--radius", text, "mm", bound, hint)
    return radii[0], radii[-1]


def _add_json(parser: ArgumentParser) -> None:
    """Add the flag for output as JSON."""
    parser.add_argument("--json", action="store_true", help="Print JSON instead of tables")


def _add_columns(parser: ArgumentParser, file: str, *, columns: str, units: str) -> None:
    """Add the flags for the columns of measured tables and for their units.

    `file` is the name of the tables in the help texts, and `columns` and `units` are examples of values.
    """
    add = parser.add_argument
    add("--columns", metavar="NAME=HEADER,...", help=f"Headers of {file}, or numbers of columns, as in {columns}")
    add("--units", metavar="NAME=UNIT,...", help=f"Units of columns whose headers have none, as in {units}")


def _add_counts(parser: ArgumentParser) -> None:
    """Add the flag for the notation of counts in a table."""
    parser.add_argument(
        "--counts-as",
        choices=("unsigned", "offset"),
        help="How counts without a sign are encoded: in two's complement (unsigned), or with half the range added",
    )


def _add_force(parser: ArgumentParser) -> None:
    """Add the flag that allows existing files to be replaced."""
    parser.add_argument(
        "--force",
        action="store_true",
        help="Rename foreign or changed files to NAME.bak instead of refusing to overwrite them",
    )


def _add_design(parser: ArgumentParser) -> None:
    """Add the flags that specify a design."""
    add = parser.add_argument
    add("named", metavar="DESIGN", nargs="?", help=f"Preset or design file (default {DEFAULT_DESIGN})")
    add("--nl", metavar="NL", help="Target nonlinearity [fraction, 0.05 = 5 %%], greater than 0 and less than 0.5")
    add("--p-max", metavar="P", help="Target force ratio at the largest modulus [1], greater than 1 and at most 100")
    add("--design", metavar="NAME|FILE.toml", default=DEFAULT_DESIGN, help="Another way to give DESIGN")
    add("--process", metavar="NAME", help="Print process; pipeline design --list-processes lists them")
    add(
        "--set",
        metavar="TABLE.KEY=VALUE",
        action="append",
        default=[],
        help="Set any key of the design file, or unset it if VALUE is empty; may be repeated",
    )


def _add_whole_run(parser: ArgumentParser) -> None:
    """Add the flags for a design and for the options of its run, which `pipeline run` and `pipeline design` share."""
    # A command without one of these flags has the default. Only `pipeline design` writes files for fabrication.
    parser.set_defaults(look=False, watch=None, fabrication=False)
    add = parser.add_argument
    _add_design(parser)
    add("--out", metavar="DIR", type=Path, help="Output folder (default outputs/NAME)")
    _add_force(parser)
    add(
        "--fruit-stiffness",
        metavar="|".join(FRUIT_STIFFNESSES),
        default="contact",
        help="How the stiffness of the fruit is computed: as a contact problem (contact, the default), "
        "or by equation (6) of the paper (hayes)",
    )
    add(
        "--tol",
        metavar="TOL",
        help=f"Allowed relative error of both spring stiffnesses (default {DEFAULT_TOLERANCE:g})",
    )
    add("--fields", action="store_true", help="Write the fields in mm and MPa (VTU), and a CalculiX deck")
    add("--verbose", action="store_true", help="Print every verdict, error and note, instead of one screen")
    _add_json(parser)


def _add_run(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline run`."""
    _add_whole_run(parser)
    add = parser.add_argument
    add(
        "--look",
        action="store_true",
        help="Write the report within seconds, with errors of about 2 %% and without solids",
    )
    add("--watch", metavar="FILE.toml", help="Repeat a run with --look whenever this file is saved, until Ctrl-C")


def _add_making(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline design`."""
    _add_whole_run(parser)
    parser.set_defaults(fabrication=True)
    parser.add_argument("--list-processes", action="store_true", help="List the print processes and exit")


def _add_suggest(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline suggest`."""
    add = parser.add_argument
    _add_design(parser)
    add(
        "--fruit",
        metavar="TEXT|NAME|FILE.json",
        help="Find a sensor for this fruit, starting from the most similar preset. Give its sizes and moduli in mm "
        "and MPa, as in 'radius 26, E 0.3 to 2', a fruit such as pear, or the output of pipeline modulus --json",
    )
    add("--keep", metavar="TABLE.KEY", action="append", default=[], help="Key that must not change; may be repeated")
    add("--out", metavar="FILE.toml", type=Path, help="Write the design that passes to this file")
    _add_force(parser)
    _add_json(parser)


def _add_explain(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline explain`."""
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        help="Verdict, symbol or key of report.json; without NAME, all verdicts and symbols are listed",
    )
    parser.add_argument("--out", metavar="DIR", type=Path, help="Output folder whose value of NAME is also printed")
    _add_json(parser)


def _add_check(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline check`."""
    add = parser.add_argument
    add("path", metavar="PATH", type=Path, help="Output folder, or a STEP, STL or 3MF file in mm")
    add(
        "--design",
        metavar="NAME|FILE.toml",
        help="Preset or design file; a file is also compared with the nearest part of this design",
    )
    add(
        "--process",
        metavar="NAME",
        help=f"Process whose rules apply to a file (default {DEFAULT_PROCESS}); a folder has its own process",
    )
    add(
        "--solve",
        action="store_true",
        help="Solve a STEP file by finite elements for K_l and K_h, held and pressed like the housing of --design",
    )
    add(
        "--held",
        metavar="X,Y,Z",
        action="append",
        default=[],
        help="Hold the face at this point [mm], instead of the held faces of the housing; may be repeated",
    )
    add(
        "--pressed",
        metavar="X,Y,Z",
        action="append",
        default=[],
        help="Press the face at this point [mm], instead of the tips of the housing; may be repeated. "
        "Give the low tip of --design first",
    )
    _add_json(parser)


def _add_view(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline view`."""
    add = parser.add_argument
    add("folder", metavar="DIR", type=Path, help="Output folder to show")
    add("--png", metavar="DIR", type=Path, help="Write pictures to this folder instead of opening a window")
    add(
        "--html", metavar="FILE", type=Path, help="Write bodies and fields as one web page that works without a network"
    )
    _add_force(parser)


def _add_modulus(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline modulus`."""
    add = parser.add_argument
    add(
        "files",
        metavar="FILE",
        nargs="*",
        type=Path,
        help="Table of force and travel, CSV or XLSX, as exported by the testing machine",
    )
    _add_pressed_body(parser)
    _add_compression(parser)
    _add_columns(parser, "the file", columns="force=Last,travel=3", units="force=kN,travel=um")
    add(
        "--compression-negative",
        action="store_true",
        help="Reverse the signs, because the machine records compression as negative",
    )
    add(
        "--per",
        choices=("file", "folder"),
        default="file",
        help="Whether one file or one folder holds the tests of one fruit (default file)",
    )
    add("--plot", metavar="FILE", type=Path, help="Write curves and fits to this web page, FILE.html")
    _add_force(parser)
    _add_json(parser)


def _add_compression(parser: ArgumentParser) -> None:
    """Add the flags for Poisson's ratio, the testing machine, and the strains at which moduli are determined."""
    add = parser.add_argument
    add("--poisson", metavar="NU", type=number, help="Poisson's ratio of the flesh (default 0.3)")
    add(
        "--poisson-error",
        metavar="NU",
        type=number,
        default=0.05,
        help="Largest error of Poisson's ratio (default 0.05)",
    )
    add(
        "--plate-area",
        metavar="MM2",
        type=number,
        help="Area by which the paper's modulus divides the force [mm^2] (default 900, or the area of a flat end)",
    )
    add(
        "--compliance",
        metavar="UM/N",
        type=number,
        default=0.0,
        help="Measured compliance of the machine's frame and load cell [um/N] (default 0)",
    )
    add(
        "--compliance-error",
        metavar="UM/N",
        type=number,
        help="Largest error of this compliance (default: a tenth of it)",
    )
    add(
        "--strain",
        metavar="PERCENT",
        default="5,2,10",
        help="Strains of the secant and tangent moduli, relative to the height [%%] (default 5,2,10)",
    )


def _add_pressed_body(parser: ArgumentParser) -> None:
    """Add the flags for the shape of a compressed body, and for what presses and supports it."""
    add = parser.add_argument
    add(
        "--body",
        choices=BODIES,
        metavar="BODY",
        help=f"Shape of the body, one of {', '.join(BODIES)} (default: ball if only --radius is given, "
        "ellipsoid if --height is given too)",
    )
    add("--height", metavar="MM", type=number, help="Height of the body in the direction of the press [mm]")
    add(
        "--radius", metavar="MM", type=number, help="Radius of the body, or its radius of curvature at the contact [mm]"
    )
    add("--radius-across", metavar="MM", type=number, help="Second radius of curvature at the contact [mm]")
    add("--length", metavar="MM", type=number, help="Length of a cylinder on its side, or of a block [mm]")
    add("--width", metavar="MM", type=number, help="Width of a block [mm]")
    add(
        "--sizes",
        metavar="FILE",
        type=Path,
        help="Table of the sizes of each specimen [mm], with the columns file, height, radius, ...",
    )
    add("--plunger", choices=("flat", "ball"), help="End of the plunger that replaces the upper plate")
    add("--plunger-radius", metavar="MM", type=number, help="Radius of the plunger, or of its ball [mm]")
    add("--support", choices=SUPPORTS, help="What is under the body: a plate, a table, or a rigid seat")


def _add_calibrate(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline calibrate`."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="Output folder of the unit's design")
    add(
        "measured",
        metavar="MEASURED.csv",
        type=Path,
        help="Table of weights, with the columns tip,weight_g,deflection_mm and, if known, t_s and the counts of each "
        "channel; or table of a coupon, with the columns coupon,weight_g,deflection_mm",
    )
    add(
        "--after",
        metavar="SECONDS",
        type=number,
        help="Time from hanging a weight to reading the deflection [s], for springs that creep (default 30); "
        "a column t_s gives it for each row",
    )
    add(
        "--fruit",
        metavar="FRUIT.csv",
        type=Path,
        help="Table of fruit whose firmness another instrument measured, to find the scale of that instrument; "
        "its columns are fruit,firmness_N (or E_MPa), a force for each tip, and t_s if known",
    )
    add(
        "--plate",
        metavar="PLATE.csv",
        type=Path,
        help="Press of all tips on a hard flat plate, to calibrate the deflections; "
        "its columns are travel_mm and the counts of each channel",
    )
    _add_ball(parser)
    _add_columns(parser, "the tables", columns="force=Gewicht,counts_l=4", units="force=g,deflection=um")
    _add_counts(parser)
    add("--out", metavar="unit.toml", type=Path, help="Write the unit to this file, for pipeline read --unit")
    add(
        "--classes",
        metavar="NAMES",
        default="",
        help="Ripeness classes for the readings of the unit, as in ripe:0.8,unripe",
    )
    _add_force(parser)
    _add_json(parser)


def _add_ball(parser: ArgumentParser) -> None:
    """Add the flags for the presses on a reference ball, and for the properties of this ball."""
    add = parser.add_argument
    add(
        "--ball",
        metavar="PRESSES.csv",
        type=Path,
        help="Presses on a rubber ball, to correct readings for the form of the domes; a file as for pipeline read",
    )
    add(
        "--ball-reduced-modulus",
        metavar="MPA",
        type=number,
        help="E / (1 - nu^2) of the ball [MPa], measured by pipeline modulus",
    )
    add("--ball-radius", metavar="MM", type=number, help="Radius of the ball [mm]")
    add(
        "--ball-modulus-error",
        metavar="PERCENT",
        type=number,
        help="Error of this reduced modulus (95 %%), u_percent of pipeline modulus [%%]",
    )


def _add_read(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline read`."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="Output folder of the sensor's design")
    add(
        "signal",
        metavar="FILE.csv",
        nargs="?",
        help="Presses, with the column t_s or a time for each channel, and a force or counts for each tip; "
        "- reads the standard input",
    )
    add(
        "--forces",
        metavar="F1,F2",
        help="One reading of a pair of tips [N]; write --forces=-0.5,1 if the first force is negative",
    )
    add(
        "--unit",
        metavar="unit.toml",
        type=Path,
        help="Unit whose calibration is used, written by pipeline calibrate (default: the unit as designed)",
    )
    add("--classes", metavar="NAMES", help="Ripeness classes by modulus [MPa], as in ripe:0.8,turning:1.6,unripe")
    add(
        "--radius",
        metavar="R1,R2",
        help="Principal radii of the fruit, or one radius if it is round [mm] (default: the radii of the design)",
    )
    _add_columns(parser, "FILE.csv", columns="t=1,F_l=Kraft", units="t=ms,F_l=mN")
    _add_counts(parser)
    add("--each", action="store_true", help="Print a reading of the press up to each sample")
    add(
        "--fruit-presses",
        metavar="N",
        type=int,
        help="Combine N presses of one fruit into one reading, or all presses if N is 0 "
        "(default: one reading for each press, or for each fruit in a column fruit)",
    )
    _add_firmware(parser)
    _add_force(parser)
    add("--json", action="store_true", help="Print JSON; for FILE.csv, one object on each line")


def _add_firmware(parser: ArgumentParser) -> None:
    """Add the flags that request programs for the board of the sensor."""
    add = parser.add_argument
    add("--c-header", metavar="FILE.h", type=Path, help="Write the read-out of this unit as a C99 header")
    add("--micropython", metavar="FILE.py", type=Path, help="Write the read-out of this unit in MicroPython")
    add(
        "--logger",
        metavar="DIR",
        type=Path,
        nargs="?",
        const=True,  # the value of --logger without DIR
        help="Write the programs of the board in MicroPython and for Arduino (default DIR: OUT-board); "
        "they print counts, or E if --unit is given",
    )


def _add_simulate(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline simulate`."""
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="Output folder of the sensor's design")
    add(
        "--prove",
        metavar="N",
        type=int,
        help="Draw N fruits, presses and units at random from all ranges of the design, "
        "and compare the readings with the true moduli",
    )
    add("--out", metavar="FILE.csv", type=Path, help="Write the log of presses on a fruit, for pipeline read")
    add(
        "--unit",
        metavar="unit.toml",
        type=Path,
        help="Unit that presses the fruit, written by pipeline calibrate (default: the unit as designed)",
    )
    _add_simulated_fruit(parser)
    _add_simulated_pose(parser)
    _add_simulated_presses(parser)
    add(
        "--weights",
        metavar="FILE.csv",
        type=Path,
        help="Write a table of weights on a unit with random errors, for pipeline calibrate",
    )
    add(
        "--plate",
        metavar="FILE.csv",
        type=Path,
        help="Write the press of this unit on a hard plate, for pipeline calibrate",
    )
    add(
        "--ball",
        metavar="FILE.csv",
        type=Path,
        help="Write the presses of this unit on a rubber ball, for pipeline calibrate",
    )
    add("--seed", metavar="N", type=int, default=1, help="Seed of all random numbers (default 1)")
    _add_force(parser)
    _add_json(parser)


def _add_simulated_fruit(parser: ArgumentParser) -> None:
    """Add the flags for the fruit of a simulation."""
    add = parser.add_argument
    add(
        "--E", metavar="MPA", type=number, help="Modulus of the fruit [MPa] (default: the middle of the design's range)"
    )
    add(
        "--radius",
        metavar="R1,R2",
        help="Principal radii of the fruit, or one radius if it is round [mm] (default: the radii of the design)",
    )
    add(
        "--azimuth",
        metavar="DEG",
        type=number,
        help="Direction of the first radius, from +x of the housing [deg] (default: as in the design)",
    )
    add(
        "--thickness",
        metavar="MM",
        type=number,
        help="Thickness of the flesh over the stone [mm] (default: as in the design)",
    )


def _add_simulated_pose(parser: ArgumentParser) -> None:
    """Add the flags for the pose of the sensor on the fruit of a simulation."""
    add = parser.add_argument
    add(
        "--tilt",
        metavar="DEG",
        type=number,
        help="Angle between the sensor's axis and the normal of the skin [deg] (default 0)",
    )
    add("--off-centre", metavar="MM", type=number, help="Distance of the sensor from the apex [mm] (default 0)")
    add(
        "--towards",
        metavar="DEG",
        type=number,
        help="Direction of --tilt and --off-centre, from +x of the housing [deg] (default 0)",
    )


def _add_simulated_presses(parser: ArgumentParser) -> None:
    """Add the flags for the presses of a simulation, and for what makes them differ from ideal presses."""
    add = parser.add_argument
    add(
        "--presses",
        metavar="N",
        type=int,
        help="Number of presses on the fruit, each rotated relative to the previous one (default 1)",
    )
    add(
        "--rate",
        metavar="HZ",
        type=number,
        help="Number of samples per second [Hz] (default: the rate of the read-out)",
    )
    add("--noise", action="store_true", help="Add the noise and the drift of the channels")
    add("--uneven", action="store_true", help="Add the unevenness of skin and flesh that the design allows")
    add("--bruise", metavar="MM", type=number, help="Radius of a bruise of half the modulus, under the first tip [mm]")
    add(
        "--relax",
        metavar="SHARE:S,...",
        help="Relaxation of the flesh: fractions of the force and their times [s], as in 0.25:5,0.33:120",
    )


def _add_engine(parser: ArgumentParser) -> None:
    """Add the flags that determine where a study is solved and stored."""
    add = parser.add_argument
    add(
        "--out",
        metavar="DIR",
        type=Path,
        help="Folder of study.sqlite (default outputs/NAME, with NAME from the study file)",
    )
    add("--processes", metavar="N", type=int, help="Number of processes on this machine (default: one per core)")
    add("--scheduler", metavar="ADDRESS", help="Solve on the Dask cluster with this scheduler, tcp://HOST:PORT")


def _add_study(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline study`."""
    add = parser.add_argument
    add("file", metavar="FILE.toml", type=Path, help="Study file, as described in docs/studies.md")
    _add_engine(parser)
    add("--export", metavar="FILE.csv", type=Path, help="Write the table of all points to this file")
    add("--html", action="store_true", help="Write the page study.html to the folder of the study")
    _add_force(parser)
    _add_json(parser)


def _add_optimise(parser: ArgumentParser) -> None:
    """Add the flags of `pipeline optimise`."""
    parser.add_argument(
        "file",
        metavar="FILE.toml",
        type=Path,
        help="Study file with a table [optimise], as described in docs/studies.md",
    )
    _add_engine(parser)
    _add_force(parser)
    _add_json(parser)


COMMANDS = {
    "run": Command(
        module="twintip.commands.run",
        purpose="design a sensor, solve it by finite elements, and check it against its targets",
        example="pipeline run --nl 0.05 --out outputs/mine",
        add_flags=_add_run,
    ),
    "design": Command(
        module="twintip.commands.design",
        purpose="run a design, write the files for fabrication, and check their geometry",
        example="pipeline design",
        add_flags=_add_making,
    ),
    "suggest": Command(
        module="twintip.commands.suggest",
        purpose="find the nearest design that passes all verdicts",
        example="""pipeline suggest --out mine.toml \\
         --fruit 'radius 45 to 52 by 90 to 130, flesh 9 to 18, E 0.5 to 3'""",
        add_flags=_add_suggest,
    ),
    "explain": Command(
        module="twintip.commands.explain",
        purpose="explain a verdict, a symbol or a key of report.json",
        example="pipeline explain NL --out outputs/paper",
        add_flags=_add_explain,
    ),
    "check": Command(
        module="twintip.commands.check",
        purpose="check the geometry of an output folder, or of a file of any origin",
        example="pipeline check outputs/paper",
        add_flags=_add_check,
    ),
    "view": Command(
        module="twintip.commands.view",
        purpose="show the parts, fields and response of a run",
        example="pipeline view outputs/paper --png pictures",
        add_flags=_add_view,
    ),
    "doctor": Command(
        module="twintip.commands.doctor",
        purpose="check whether this machine has what the commands need",
        example="pipeline doctor",
        add_flags=lambda _: None,
    ),
    "modulus": Command(
        module="twintip.commands.modulus",
        purpose="find the modulus of fruit from compression tests",
        example="pipeline modulus mango-1.csv mango-2.csv --height 70 --radius 35",
        add_flags=_add_modulus,
    ),
    "calibrate": Command(
        module="twintip.commands.calibrate",
        purpose="calibrate the springs of a printed unit from measurements",
        example="pipeline calibrate outputs/paper weights.csv --out unit.toml",
        add_flags=_add_calibrate,
    ),
    "read": Command(
        module="twintip.commands.read",
        purpose="read the modulus and ripeness of a fruit from forces",
        example="pipeline read outputs/paper --forces 0.411,1.076",
        add_flags=_add_read,
    ),
    "simulate": Command(
        module="twintip.commands.simulate",
        purpose="simulate presses of a unit on fruit, or prove a design by many such presses",
        example="pipeline simulate outputs/mango --prove 60",
        add_flags=_add_simulate,
    ),
    "study": Command(
        module="twintip.commands.study",
        purpose="solve many variations of one design, as a study file specifies",
        example="pipeline study springs.toml --export springs.csv",
        add_flags=_add_study,
    ),
    "optimise": Command(
        module="twintip.commands.optimise",
        purpose="find the design that minimises a number while its verdicts pass",
        example="pipeline optimise sharper.toml",
        add_flags=_add_optimise,
    ),
}

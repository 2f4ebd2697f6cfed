"""The commands and their flags, for help and parsing; nothing heavy is imported here."""

from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from pipeline.options import DEFAULT_DESIGN, DEFAULT_TOLERANCE, FRUIT_STIFFNESSES
from sensor.quantity import Bounds, parse_number, validation_error

DEFAULT_PROCESS = "fdm-petg"
BODIES = ("ball", "ellipsoid", "cylinder-end", "cylinder-side", "block")
SUPPORTS = ("plate", "table", "seat")
_MAX_RADII = 2


class Command(NamedTuple):
    """A command: the module that runs it, its purpose, an example, and the function that adds its flags."""

    module: str
    purpose: str
    example: str
    add_flags: Callable[[ArgumentParser], None]


def number(text: str) -> float:
    """Return the number of a flag in common notations; raises ValueError for other text."""
    value = parse_number(text)
    if value is None:
        raise ValueError(text)
    return value


def parse_radii(text: str, bounds: Bounds, bound: str, hint: str) -> tuple[float, float]:
    """Return the principal radii [mm] that `--radius` gives; of a round fruit it gives one.

    Raises InputError, with `bound` and `hint` in its message, unless there are one or two numbers within `bounds`.
    """
    radii = [value for value in map(parse_number, text.split(",")) if value is not None]
    if len(radii) not in (1, _MAX_RADII) or len(radii) != text.count(",") + 1 or not all(map(bounds.hold, radii)):
        raise validation_error("--radius", text, "mm", bound, hint)
    return radii[0], radii[-1]


def _add_json(parser: ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def _add_counts(parser: ArgumentParser) -> None:
    words = "how counts without signs are written: in two's complement, or with half the range added"
    parser.add_argument("--counts-as", choices=("unsigned", "offset"), help=words)


def _add_force(parser: ArgumentParser) -> None:
    words = "keep other and changed files as NAME.bak instead of refusing them"
    parser.add_argument("--force", action="store_true", help=words)


def _add_design(parser: ArgumentParser) -> None:
    """Add the flags that give a design."""
    add = parser.add_argument
    add("named", metavar="DESIGN", nargs="?", help=f"preset or file (default {DEFAULT_DESIGN})")
    add("--nl", metavar="NL", help="target nonlinearity [fraction, 0.05 = 5 %%], greater than 0 and less than 0.5")
    add("--p-max", metavar="P", help="target force ratio at the largest modulus [1], greater than 1 and at most 100")
    add("--design", metavar="NAME|FILE.toml", default=DEFAULT_DESIGN, help="the same")
    add("--process", metavar="NAME", help="print process, see pipeline design --list-processes")
    words = "any key of the design file, unset if VALUE is empty; repeatable"
    add("--set", metavar="TABLE.KEY=VALUE", action="append", default=[], help=words)


def _add_whole_run(parser: ArgumentParser) -> None:
    """Add the flags for a design and the options of its run, without files for fabrication."""
    parser.set_defaults(look=False, watch=None, fabrication=False)
    add = parser.add_argument
    _add_design(parser)
    add("--out", metavar="DIR", type=Path, help="the output folder itself (default outputs/NAME)")
    _add_force(parser)
    stiffnesses = "|".join(FRUIT_STIFFNESSES)
    add("--fruit-stiffness", metavar=stiffnesses, default="contact", help="true contact, or the paper's (6)")
    add("--tol", metavar="TOL", help=f"relative error allowed to both stiffnesses (default {DEFAULT_TOLERANCE:g})")
    add("--fields", action="store_true", help="write fields in mm and MPa (VTU), and a CalculiX deck")
    add("--verbose", action="store_true", help="print every verdict, error and note, not one screen")
    _add_json(parser)


def _add_run(parser: ArgumentParser) -> None:
    _add_whole_run(parser)
    add = parser.add_argument
    add("--look", action="store_true", help="answer and page to some 2 %%, without solids: in seconds")
    add("--watch", metavar="FILE.toml", help="look at a design file again whenever it is written, until Ctrl-C")


def _add_making(parser: ArgumentParser) -> None:
    _add_whole_run(parser)
    parser.set_defaults(fabrication=True)
    parser.add_argument("--list-processes", action="store_true", help="print the print processes and leave")


def _add_suggest(parser: ArgumentParser) -> None:
    add = parser.add_argument
    _add_design(parser)
    words = (
        "find a sensor for this fruit from the preset most like it: 'radius 26, E 0.3 to 2' [mm, MPa], "
        "the name of a fruit, as pear, or a .json file"
    )
    add("--fruit", metavar="TEXT|NAME|FILE.json", help=f"{words} of pipeline modulus --json")
    add("--keep", metavar="TABLE.KEY", action="append", default=[], help="a key that stays as it is; repeatable")
    add("--out", metavar="FILE.toml", type=Path, help="write the design that passes there")
    _add_force(parser)
    _add_json(parser)


def _add_explain(parser: ArgumentParser) -> None:
    words = "a verdict, a symbol or a key of report.json; without it verdicts and symbols are listed"
    parser.add_argument("name", metavar="NAME", nargs="?", help=words)
    parser.add_argument("--out", metavar="DIR", type=Path, help="an output folder, whose number is printed too")
    _add_json(parser)


def _add_check(parser: ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", type=Path, help="an output folder, or a STEP, STL or 3MF file [mm]")
    words = "also compare a file with the part of this design, preset or file, that is nearest to it"
    parser.add_argument("--design", metavar="NAME|FILE.toml", help=words)
    words = f"process whose rules a file is judged by (default {DEFAULT_PROCESS}; a folder has its own)"
    parser.add_argument("--process", metavar="NAME", help=words)
    words = "solve a STEP file by finite elements: K_l and K_h, held and pressed as the housing of --design"
    parser.add_argument("--solve", action="store_true", help=words)
    words = "hold the face with this point instead [mm]; repeatable"
    parser.add_argument("--held", metavar="X,Y,Z", action="append", default=[], help=words)
    words = "press the face with this point instead [mm], of a design first the low, then the high tip; repeatable"
    parser.add_argument("--pressed", metavar="X,Y,Z", action="append", default=[], help=words)
    _add_json(parser)


def _add_view(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("folder", metavar="DIR", type=Path, help="an output folder")
    add("--png", metavar="DIR", type=Path, help="write pictures there instead of opening a window")
    add("--html", metavar="FILE", type=Path, help="write bodies and fields as one web page that needs no network")
    _add_force(parser)


def _add_modulus(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("files", metavar="FILE", nargs="*", type=Path, help="a table of force and travel, CSV or XLSX, as exported")
    alone = "with only --radius: a ball, or an ellipsoid"
    add("--body", choices=BODIES, metavar="BODY", help=f"what is pressed, one of {', '.join(BODIES)} ({alone})")
    add("--height", metavar="MM", type=number, help="its height along the press [mm]")
    add("--radius", metavar="MM", type=number, help="its radius, or its radius of curvature at the contact [mm]")
    add("--radius-across", metavar="MM", type=number, help="the other radius of curvature there [mm]")
    add("--length", metavar="MM", type=number, help="length of a cylinder on its side, or of a block [mm]")
    add("--width", metavar="MM", type=number, help="width of a block [mm]")
    add("--sizes", metavar="FILE", type=Path, help="a table of file, height, radius, ... [mm]: sizes of each specimen")
    add("--plunger", choices=("flat", "ball"), help="end of the plunger that presses instead of a plate")
    add("--plunger-radius", metavar="MM", type=number, help="radius of the plunger, or of its ball [mm]")
    add("--support", choices=SUPPORTS, help="under the body: a plate, a table, or a rigid seat")
    add("--poisson", metavar="NU", type=number, help="Poisson's ratio of the flesh (default 0.3)")
    add("--poisson-error", metavar="NU", type=number, default=0.05, help="its largest error (default 0.05)")
    words = "area that the paper's modulus divides by [mm^2] (default 900, or the area of a flat end)"
    add("--plate-area", metavar="MM2", type=number, help=words)
    add("--compliance", metavar="UM/N", type=number, default=0.0, help="of frame and load cell, measured [um/N]")
    add("--compliance-error", metavar="UM/N", type=number, help="its largest error (default a tenth of it)")
    add("--strain", metavar="PERCENT", default="5,2,10", help="strains of secant and tangent [%%] (default 5,2,10)")
    add("--columns", metavar="NAME=HEADER,...", help="headers, or numbers of columns, as in force=Last,travel=3")
    add("--units", metavar="NAME=UNIT,...", help="units if the file gives none, as in force=kN,travel=um")
    add("--compression-negative", action="store_true", help="the machine counts compression negative: turn the signs")
    add("--per", choices=("file", "folder"), default="file", help="what holds the tests of one fruit (default file)")
    add("--plot", metavar="FILE", type=Path, help="draw curves and fits as one web page (FILE.html)")
    _add_force(parser)
    _add_json(parser)


def _add_calibrate(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the unit's design")
    columns = "tip,weight_g,deflection_mm, with t_s or counts of each channel; or coupon,..."
    add("measured", metavar="MEASURED.csv", type=Path, help=f"a table with the columns {columns}")
    since = "seconds from the hanging of a weight to its reading, for springs that creep (default: 30)"
    add("--after", metavar="SECONDS", type=number, help=f"{since}; a column t_s has them for each row")
    firm = "fruit,firmness_N (or E_MPa), a force for each tip, t_s if known: fruit that another instrument measured"
    add("--fruit", metavar="FRUIT.csv", type=Path, help=f"find the scale of its firmness, of the columns {firm}")
    pressed = "travel_mm and the counts of each channel: a press on a hard flat plate, all tips on it"
    add("--plate", metavar="PLATE.csv", type=Path, help=f"calibrate deflections, of the columns {pressed}")
    on_ball = "presses on a ball of rubber, a file as pipeline read takes"
    add("--ball", metavar="PRESSES.csv", type=Path, help=f"correct readings for the form of the domes, by {on_ball}")
    add("--ball-reduced-modulus", metavar="MPA", type=number, help="its E / (1 - nu^2) by pipeline modulus [MPa]")
    add("--ball-radius", metavar="MM", type=number, help="radius of the ball [mm]")
    add(
        "--ball-modulus-error",
        metavar="PERCENT",
        type=number,
        help="its error (95 %%), u_percent of pipeline modulus [%%]",
    )
    add("--columns", metavar="NAME=HEADER,...", help="headers or numbers of columns, as in force=Gewicht,counts_l=4")
    add("--units", metavar="NAME=UNIT,...", help="units if a table gives none, as in force=g,deflection=um")
    _add_counts(parser)
    add("--out", metavar="unit.toml", type=Path, help="write the unit there, for pipeline read --unit")
    add("--classes", metavar="NAMES", default="", help="ripeness classes of its readings, as in ripe:0.8,unripe")
    _add_force(parser)
    _add_json(parser)


def _add_read(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the sensor's design")
    words = "columns t_s or a time for each channel, a force or counts for each tip; or -"
    add("signal", metavar="FILE.csv", nargs="?", help=words)
    add("--forces", metavar="F1,F2", help="one reading of a pair [N]; write --forces=-0.5,1 below 0")
    add("--unit", metavar="unit.toml", type=Path, help="the unit as pipeline calibrate found it (default: as designed)")
    add("--classes", metavar="NAMES", help="ripeness by modulus [MPa], as in ripe:0.8,turning:1.6,unripe")
    words = "principal radii of the fruit [mm], or its one radius (default: the design's)"
    add("--radius", metavar="R1,R2", help=words)
    add("--columns", metavar="NAME=HEADER,...", help="headers of FILE.csv, or numbers of columns, as in t=1,F_l=Kraft")
    add("--units", metavar="NAME=UNIT,...", help="units if FILE.csv gives none, as in t=ms,F_l=mN")
    _add_counts(parser)
    add("--each", action="store_true", help="a reading of the press up to each sample")
    words = (
        "one reading for each N presses of one fruit; 0: for all presses (default: one a press, or by a column fruit)"
    )
    add("--fruit-presses", metavar="N", type=int, help=words)
    add("--c-header", metavar="FILE.h", type=Path, help="write the read-out of this unit in C99")
    add("--micropython", metavar="FILE.py", type=Path, help="write the read-out of this unit in MicroPython")
    words = (
        "write the programs of the board, which print counts, or E with --unit: MicroPython, Arduino (DIR: OUT-board)"
    )
    add("--logger", metavar="DIR", type=Path, nargs="?", const=True, help=words)
    _add_force(parser)
    add("--json", action="store_true", help="print JSON, one object a line for a signal")


def _add_simulate(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("folder", metavar="OUT", type=Path, help="the output folder of the sensor's design")
    words = "draw N fruits, presses and units over all ranges of the design, and compare the readings with the truth"
    add("--prove", metavar="N", type=int, help=words)
    add("--out", metavar="FILE.csv", type=Path, help="write the log of presses on a fruit, for pipeline read")
    add("--unit", metavar="unit.toml", type=Path, help="the unit that presses, by its counts (default: as designed)")
    add("--E", metavar="MPA", type=number, help="modulus of the fruit [MPa] (default: middle of the design's range)")
    words = "its principal radii, or its one radius [mm] (default: the design's, as for all that follows)"
    add("--radius", metavar="R1,R2", help=words)
    add("--azimuth", metavar="DEG", type=number, help="direction of the first radius, from +x of the housing [deg]")
    add("--thickness", metavar="MM", type=number, help="flesh over its stone [mm]")
    add("--tilt", metavar="DEG", type=number, help="tilt against the normal of the skin [deg] (default 0)")
    add("--off-centre", metavar="MM", type=number, help="distance from the apex [mm] (default 0)")
    add("--towards", metavar="DEG", type=number, help="direction of both, from +x of the housing [deg] (default 0)")
    add("--presses", metavar="N", type=int, help="presses of the fruit, each turned against the one before (default 1)")
    add("--rate", metavar="HZ", type=number, help="lines a second [Hz] (default: the rate of the read-out)")
    add("--noise", action="store_true", help="with the noise and the drift of the channels")
    add("--uneven", action="store_true", help="with the uneven skin and flesh of the design")
    add("--bruise", metavar="MM", type=number, help="radius of a bruise of half the modulus, under the first tip [mm]")
    words = "flesh that relaxes: shares of the force and times [s], as in 0.25:5,0.33:120"
    add("--relax", metavar="SHARE:S,...", help=words)
    words = "write a table of weights on a unit with drawn errors, for pipeline calibrate"
    add("--weights", metavar="FILE.csv", type=Path, help=words)
    add("--plate", metavar="FILE.csv", type=Path, help="likewise, on a hard plate")
    add("--ball", metavar="FILE.csv", type=Path, help="likewise, in presses on a ball of rubber")
    add("--seed", metavar="N", type=int, default=1, help="seed of all random numbers (default 1)")
    _add_force(parser)
    _add_json(parser)


def _add_engine(parser: ArgumentParser) -> None:
    """Add the flags for where a study is solved and stored."""
    add = parser.add_argument
    add("--out", metavar="DIR", type=Path, help="folder of study.sqlite (default outputs/NAME of the study file)")
    add("--processes", metavar="N", type=int, help="processes on this machine (default: one for each core)")
    add("--scheduler", metavar="ADDRESS", help="solve on the Dask cluster of this scheduler, tcp://HOST:PORT")


def _add_study(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("file", metavar="FILE.toml", type=Path, help="the study file, see docs/studies.md")
    _add_engine(parser)
    add("--export", metavar="FILE.csv", type=Path, help="write the table of all points")
    add("--html", action="store_true", help="write its page, study.html, into its folder")
    _add_force(parser)
    _add_json(parser)


def _add_optimise(parser: ArgumentParser) -> None:
    words = "a study file with [optimise], see docs/studies.md"
    parser.add_argument("file", metavar="FILE.toml", type=Path, help=words)
    _add_engine(parser)
    _add_force(parser)
    _add_json(parser)


COMMANDS = {
    "run": Command(
        module="twintip.commands.run",
        purpose="size, shape, mesh, solve and judge a sensor",
        example="pipeline run --nl 0.05 --out outputs/mine",
        add_flags=_add_run,
    ),
    "design": Command(
        module="twintip.commands.design",
        purpose="make the files for fabrication and judge their geometry",
        example="pipeline design",
        add_flags=_add_making,
    ),
    "suggest": Command(
        module="twintip.commands.suggest",
        purpose="find the nearest design that passes",
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
        purpose="judge the geometry of files, own or foreign",
        example="pipeline check outputs/paper",
        add_flags=_add_check,
    ),
    "view": Command(
        module="twintip.commands.view",
        purpose="show the parts, fields and response",
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
        purpose="turn compression tests into the modulus of the fruit",
        example="pipeline modulus mango-1.csv mango-2.csv --height 70 --radius 35",
        add_flags=_add_modulus,
    ),
    "calibrate": Command(
        module="twintip.commands.calibrate",
        purpose="find the springs of a printed unit from measurements",
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
        purpose="press a fruit with a unit that is not printed yet; prove a design by many",
        example="pipeline simulate outputs/mango --prove 60",
        add_flags=_add_simulate,
    ),
    "study": Command(
        module="twintip.commands.study",
        purpose="solve many designs around one; a file says what varies and what is wanted",
        example="pipeline study springs.toml --export springs.csv",
        add_flags=_add_study,
    ),
    "optimise": Command(
        module="twintip.commands.optimise",
        purpose="find the design that makes a number least while verdicts pass",
        example="pipeline optimise sharper.toml",
        add_flags=_add_optimise,
    ),
}

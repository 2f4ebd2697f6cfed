"""One clean curve in the shapes that testing machines, loggers and spreadsheets export."""

import io
import itertools
import zipfile
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

TRAVEL = np.round(np.arange(26) * 0.12, 2)  # [mm]
DEPTH = np.clip(TRAVEL - 0.35, 0.0, None) / 2.0  # [mm] on each side of a ball between plates
FORCE = np.round(4.0 / 3.0 / (1.0 - 0.3**2) * np.sqrt(35.0) * DEPTH**1.5, 4)  # [N], Hertz: 1 MPa, a radius of 35 mm
TIME = np.round(2.0 * TRAVEL, 2)  # [s]
G = 9.80665e-3  # [N] of a gram
LB = 4.4482216152605


class Shape(NamedTuple):
    """A file with the flags that it needs."""

    content: bytes
    columns: str | None = None
    units: str | None = None
    suffix: str = "csv"


def table(
    labels: Sequence[str],
    columns: Sequence[Sequence[object]],
    delimiter: str = ",",
    end: str = "\n",
    cell: Callable[[object], str] = str,
) -> str:
    """Return a header and its rows."""
    rows = [labels, *zip(*columns, strict=True)]
    return (
        end.join(
            delimiter.join(cell(value) if index else str(value) for value in row) for index, row in enumerate(rows)
        )
        + end
    )


def two(force: str = "force_N", travel: str = "travel_mm", F: float = 1.0, x: float = 1.0, **how: object) -> str:
    """Return the curve under two labels, each number divided by what its unit is worth."""
    columns = [[repr(float(f"{value / of:.9g}")) for value in values] for values, of in ((FORCE, F), (TRAVEL, x))]
    return table([force, travel], columns, **how)


def three(time: str, travel: str, force: str, **how: object) -> str:
    """Return time, travel and force under three labels."""
    return table([time, travel, force], [TIME, TRAVEL, FORCE], **how)


def comma(value: object) -> str:
    """Return a number with a decimal comma."""
    return str(value).replace(".", ",")


def with_extra(label: str, values: Sequence[object] | None = None, first: bool = False) -> str:
    """Return the curve beside another column."""
    others = list(values or [1] * len(TRAVEL))
    labels, columns = ["force_N", "travel_mm"], [FORCE, TRAVEL]
    return table([label, *labels], [others, *columns]) if first else table([*labels, label], [*columns, others])


def workbook(sheets: dict[str, list[list[object]]], hidden: str = "") -> bytes:
    """Return a workbook of sheets, as a spreadsheet writes it with inline texts."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as book:
        types = "".join(
            f'<Override PartName="/xl/worksheets/sheet{number}.xml" '
            'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/>'
            for number in range(1, len(sheets) + 1)
        )
        book.writestr(
            "[Content_Types].xml",
            '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
            '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
            '<Override PartName="/xl/workbook.xml" '
            'ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
            f"{types}</Types>",
        )
        office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
        relations = "http://schemas.openxmlformats.org/package/2006/relationships"
        book.writestr(
            "_rels/.rels",
            f'<Relationships xmlns="{relations}">'
            f'<Relationship Id="a" Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        )
        main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
        named = "".join(
            f'<sheet name="{name}" sheetId="{number}" r:id="s{number}" '
            f'state="{"hidden" if name == hidden else "visible"}"/>'
            for number, name in enumerate(sheets, start=1)
        )
        book.writestr(
            "xl/workbook.xml", f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets>{named}</sheets></workbook>'
        )
        links = "".join(
            f'<Relationship Id="s{number}" Type="{office}/worksheet" Target="worksheets/sheet{number}.xml"/>'
            for number in range(1, len(sheets) + 1)
        )
        book.writestr("xl/_rels/workbook.xml.rels", f'<Relationships xmlns="{relations}">{links}</Relationships>')
        for number, rows in enumerate(sheets.values(), start=1):
            body = "".join(
                f'<row r="{line}">{"".join(cells(row, line))}</row>' for line, row in enumerate(rows, start=1)
            )
            book.writestr(
                f"xl/worksheets/sheet{number}.xml",
                f'<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>',
            )
    return out.getvalue()


def cells(row: Sequence[object], line: int) -> Iterator[str]:
    """Yield the cells of a row of a workbook; None is left out."""
    for column, value in enumerate(row):
        place = f"{chr(65 + column)}{line}"
        if isinstance(value, str):
            text = value.replace("&", "&amp;").replace("<", "&lt;")
            yield f'<c r="{place}" t="inlineStr"><is><t>{text}</t></is></c>'
        elif value is not None:
            yield f'<c r="{place}"><v>{float(value)!r}</v></c>'


def sheet(
    labels: Sequence[str], *columns: Sequence[object], above: Sequence[Sequence[object]] = ()
) -> list[list[object]]:
    """Return the rows of a sheet."""
    return [*map(list, above), list(labels), *map(list, zip(*columns, strict=True))]


UNITS = {
    "force": {
        "N": 1,
        "kN": 1e3,
        "KN": 1e3,
        "mN": 1e-3,
        "cN": 1e-2,
        "daN": 10,
        "kgf": 1e3 * G,
        "kgF": 1e3 * G,
        "KGF": 1e3 * G,
    }
    | {
        "gf": G,
        "lbf": LB,
        "lbF": LB,
        "LBF": LB,
        "Lbf": LB,
        "g": G,
        "kg": 1e3 * G,
        "Kg": 1e3 * G,
        "lb": LB,
        "lbs": LB,
        "n": 1,
    }
    | {
        "Newtons": 1,
        "newton": 1,
        "NEWTON": 1,
        "pounds": LB,
        "Pounds-force": LB,
        "grams": G,
        "ozf": LB / 16,
        "kp": 1e3 * G,
    },
    "travel": {
        "mm": 1,
        "MM": 1,
        "Mm": 1,
        "cm": 10,
        "m": 1e3,
        "um": 1e-3,
        "µm": 1e-3,
        "μm": 1e-3,
        "micron": 1e-3,
        "microns": 1e-3,
    }
    | {
        "in": 25.4,
        "IN": 25.4,
        "inch": 25.4,
        "inches": 25.4,
        "Inches": 25.4,
        "millimeters": 1,
        "Millimetres": 1,
        "nm": 1e-6,
    },
    "time": {
        "s": 1,
        "sec": 1,
        "Sec": 1,
        "sec.": 1,
        "seconds": 1,
        "SECONDS": 1,
        "ms": 1e-3,
        "msec": 1e-3,
        "min": 60,
        "h": 3600,
    },
}
LANGUAGES = {
    "de": ("Prüfzeit [s]", "Standardweg [mm]", "Standardkraft [N]"),
    "de2": ("Zeit (s)", "Eindringtiefe (mm)", "Normalkraft (N)"),
    "fr": ("Temps (s)", "Déplacement (mm)", "Force (N)"),
    "fr2": ("Temps (s)", "Enfoncement (mm)", "Charge (N)"),
    "es": ("Tiempo (s)", "Desplazamiento (mm)", "Fuerza (N)"),
    "es2": ("Tiempo (s)", "Extensión (mm)", "Carga (N)"),
    "it": ("Tempo (s)", "Spostamento (mm)", "Forza (N)"),
    "it2": ("Tempo (s)", "Corsa (mm)", "Carico (N)"),
    "pt": ("Tempo (s)", "Deslocamento (mm)", "Força (N)"),
    "ja": ("時間(s)", "変位(mm)", "荷重(N)"),
    "ja2": ("時間 (秒)", "ストローク (mm)", "試験力 (N)"),
    "zh": ("时间(s)", "位移(mm)", "力(N)"),
    "zh2": ("时间/s", "变形/mm", "载荷/N"),
    "ko": ("시간(s)", "변위(mm)", "하중(N)"),
    "nl": ("Tijd (s)", "Verplaatsing (mm)", "Kracht (N)"),
}
HEADERS = [
    ("Force (N)", "Travel (mm)"),
    ("Force [N]", "Travel [mm]"),
    ("Force{N}", "Travel{mm}"),
    ("Force <N>", "Travel <mm>"),
    ("Force/N", "Travel/mm"),
    ("Force, N", "Travel, mm"),
    ("Force: N", "Travel: mm"),
    ("Force N", "Travel mm"),
    ("Force-N", "Travel-mm"),
    ("FORCE_N", "TRAVEL_MM"),
    ("Force in N", "Travel in mm"),
    ("F[N]", "x[mm]"),
    ("F (N)", "d (mm)"),
    ("Load(N)", "Extension(mm)"),
    ("Load (N)", "Depth (mm)"),
    ("Load (N)", "Indentation (mm)"),
    ("Load (N)", "Deflection (mm)"),
    ("Normal force (N)", "Axial displacement (mm)"),
    ("Standard force [N]", "Standard travel [mm]"),
    ("StandardForce [N]", "StandardTravel [mm]"),
    ("Compressive load (N)", "Compressive extension (mm)"),
    ("Test force (N)", "Crosshead position (mm)"),
    ("Axial Force (N)", "Axial Displacement (mm)"),
    ("Fz (N)", "Position (mm)"),
    (" Force (N) ", " Travel (mm) "),
    ("Force (N):", "Travel (mm):"),
    ("Penetration force (N)", "Penetration depth (mm)"),
]
EXTRAS = [
    "Load rate", "Load cell", "Time stamp", "F max", "Travel 2", "Position setpoint", "Temperature (C)", "Strain (%)",
    "Force (%)", "x2", "Stress (MPa)", "Compression (%)", "Load/Width", "Speed (mm/min)", "Load cell (mV/V)",
    "Force Peak", "Force setpoint (N)", "Load 2", "Position error", "Displacement rate (mm/s)", "Force filtered",
    "Time of day", "Distance to target", "Energy (J)",
]  # fmt: skip


PLAIN = two()
ROWS = PLAIN.split("\n", 1)[1]


def numbers() -> Iterator[tuple[str, Shape]]:
    """Yield how cells are parted and numbers written."""
    for name, delimiter in {
        "semicolon": ";",
        "tab": "\t",
        "pipe": "|",
        "space": " ",
        "spaces": "   ",
        "comma space": ", ",
        "pipes": " | ",
    }.items():
        yield name, Shape(two(delimiter=delimiter).encode())
        if "," not in delimiter:
            yield f"{name} and decimal commas", Shape(two(delimiter=delimiter, cell=comma).encode())
    yield (
        "quoted after spaces",
        Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], ", ", cell=lambda v: f'"{v}"').encode()),
    )
    yield (
        "formulas of texts",
        Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], cell=lambda v: f'="{v}"').encode()),
    )
    yield (
        "a table in Markdown",
        Shape(
            (
                "| Force (N) | Travel (mm) |\n|---|---|\n"
                + "".join(f"| {F} | {x} |\n" for F, x in zip(FORCE, TRAVEL, strict=True))
            ).encode()
        ),
    )
    yield "quoted", Shape(two(delimiter='","').replace("\n", '"\n"').removesuffix('"').join(('"', "")).encode())
    yield (
        "quoted decimal commas",
        Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], cell=lambda v: f'"{comma(v)}"').encode()),
    )
    yield "single quotes", Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], cell=lambda v: f"'{v}'").encode())
    yield (
        "aligned",
        Shape(table(["  Force (N)", "Travel (mm)"], [FORCE, TRAVEL], "  ", cell=lambda v: f"{v:>11.4f}").encode()),
    )
    for name, text in {"comma": "{:,.1f}", "apostrophe": "{:,.1f}", "space": "{:,.1f}", "point": "{:,.1f}"}.items():
        grouped = [text.format(1e3 * value) for value in FORCE]
        if name == "point":
            grouped = [value.translate(str.maketrans(",.", ".,")) for value in grouped]
        else:
            grouped = [
                value.replace(",", {"comma": ",", "apostrophe": "'", "space": "\u202f"}[name]) for value in grouped
            ]
        travel = [comma(value) if name == "point" else value for value in TRAVEL]
        yield f"thousands by {name}", Shape(table(["Load (mN)", "Travel (mm)"], [grouped, travel], "\t").encode())
    yield "exponents", Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], cell=lambda v: f"{v:.6E}").encode())
    yield "signs", Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], cell=lambda v: f"+{v:.4f}").encode())
    yield "unicode minus", Shape(two().replace("\n0.0,0.0\n", "\n\u22120.0,0.0\n").encode())
    yield "many digits", Shape(table(["force_N", "travel_mm"], [FORCE, TRAVEL], cell=lambda v: f"{v:.14f}").encode())
    yield (
        "units in cells",
        Shape(table(["Force", "Travel"], [[f"{v} N" for v in FORCE], [f"{v} mm" for v in TRAVEL]]).encode()),
    )


def encodings() -> Iterator[tuple[str, Shape]]:
    """Yield encodings and line ends."""
    for encoding in ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"):
        yield encoding, Shape(three("Prüfzeit [s]", "Weg [µm]".replace("µ", "m"), "Kraft [N]").encode(encoding))
    yield "bom utf-16-be", Shape(b"\xfe\xff" + PLAIN.encode("utf-16-be"))
    for name, end in {"crlf": "\r\n", "cr": "\r", "crcrlf": "\r\r\n", "double": "\n\n"}.items():
        yield name, Shape(two(end=end).encode())
    yield "no last newline", Shape(PLAIN.rstrip("\n").encode())
    yield "ctrl-z", Shape(PLAIN.encode() + b"\x1a")
    for name, labels in LANGUAGES.items():
        encodings = {"ja": "cp932", "zh": "gb18030", "ko": "cp949"}
        yield name, Shape(three(*labels).encode())
        yield f"{name} before Unicode", Shape(three(*labels, delimiter="\t").encode(encodings.get(name[:2], "cp1252")))
    for name, encoding in {"fr": "mac_roman", "de": "cp850", "ja": "euc_jp", "ja2": "iso2022_jp"}.items():
        yield f"{name} in {encoding}", Shape(three(*LANGUAGES[name]).encode(encoding))
    wide = str.maketrans({mark: chr(ord(mark) + 0xFEE0) for mark in "()[]N"})
    yield (
        "wide brackets",
        Shape(three(*(label.translate(wide) for label in ("時間(秒)", "変位[mm]", "荷重(N)"))).encode()),
    )
    yield "zh big5", Shape(three("時間(s)", "位移(mm)", "載荷(N)").encode("big5"))


def headers() -> Iterator[tuple[str, Shape]]:
    """Yield headers and units."""
    for force, travel in HEADERS:
        chosen = None if travel[0] != "d" and force[:4] != "Pene" else f"force={force},travel={travel}"
        yield f"header {force}, {travel}", Shape(two(force, travel, delimiter="\t").encode(), chosen)
    for unit, factor in UNITS["force"].items():
        yield f"force in {unit}", Shape(two(f"Load [{unit}]", F=factor).encode())
    for unit, factor in UNITS["travel"].items():
        yield f"travel in {unit}", Shape(two(travel=f"Travel ({unit})", x=factor).encode())
    for unit, factor in UNITS["time"].items():
        yield (
            f"time in {unit}",
            Shape(table([f"Time ({unit})", "F (N)", "x (mm)"], [TIME / factor, FORCE, TRAVEL]).encode()),
        )
    for name, units in {
        "row": "N,mm",
        "brackets": "(N),(mm)",
        "square": "[N],[mm]",
        "capitals": "N,MM",
        "words": "Newtons,millimeters",
    }.items():
        yield f"units below, {name}", Shape(f"Force,Travel\n{units}\n{ROWS}".encode())
        yield f"units below a blank row, {name}", Shape(f"Force,Travel\n\n{units}\n{ROWS}".encode())
    yield "blank row below units", Shape(f"Force,Travel\nN,mm\n\n{ROWS}".encode())
    yield "header in two languages", Shape(f"Force (N),Travel (mm)\nKraft,Weg\n{ROWS}".encode())
    yield "units above", Shape(f"Force unit,N\nTravel unit: mm\n\nForce,Travel\n{ROWS}".encode())
    yield "units above in kN", Shape(("Units: kN, mm\n" + two("Force", "Travel", F=1e3)).encode())
    yield "units by flags", Shape(two("Force", "Travel", F=1e3).encode(), None, "force=kN")
    yield "optional unit unknown", Shape(three("Time (fortnight)", "Travel (mm)", "Force (N)").encode())


def beside() -> Iterator[tuple[str, Shape]]:
    """Yield other columns and rows."""
    for label in EXTRAS:
        yield f"beside {label}", Shape(with_extra(label).encode())
    yield "index first", Shape(with_extra("", range(26), first=True).encode())
    yield "index named", Shape(with_extra("No.", range(26), first=True).encode())
    yield "notes", Shape(with_extra("note", ["ok, fine"] * 26).replace("ok, fine", '"ok, fine"').encode())
    yield "empty notes", Shape(with_extra("note", [""] * 26).encode())
    yield "trailing comma", Shape(PLAIN.replace("\n", ",\n").encode())
    yield (
        "trailing comma in rows",
        Shape(f"force_N,travel_mm\n{ROWS}".replace("\n", ",\n").replace("mm,", "mm").encode()),
    )
    yield "swapped order", Shape(table(["travel_mm", "force_N"], [TRAVEL, FORCE]).encode())
    yield (
        "two times",
        Shape(table(["Time (s)", "Total time (s)", "F (N)", "x (mm)"], [TIME, TIME, FORCE, TRAVEL]).encode()),
    )
    yield (
        "date and time",
        Shape(
            table(
                ["Date", "Time", "F (N)", "x (mm)"],
                [["2024-05-06"] * 26, [f"12:00:{v:05.2f}" for v in TIME], FORCE, TRAVEL],
            ).encode()
        ),
    )
    yield (
        "date in time",
        Shape(
            table(["Time", "F (N)", "x (mm)"], [[f"2024-05-06 12:00:{v:05.2f}" for v in TIME], FORCE, TRAVEL]).encode()
        ),
    )
    yield "odd times", Shape(table(["Time", "F (N)", "x (mm)"], [["6.5.24 12h"] * 26, FORCE, TRAVEL]).encode())
    yield "line break in header", Shape(PLAIN.replace("force_N,travel_mm", '"Force\n(N)","Travel\n(mm)"').encode())
    for name, above in {
        "keys": "Operator,Smith\nDate,2024-05-06\nSpeed,5 mm/min\n\n",
        "known words": "Load cell,500 N\nTravel speed,1 mm/s\nForce limit (N),100\nTime,12:30\nExtension rate: 5\n",
        "numbers": "Speed,5\nHeight,70\nArea,900\n\n",
        "sentence": '"Test 3: a ""fine"" mango, pressed at noon"\n',
        "broken quote": '"Test" 3, mango\n',
        "sep": "sep=,\n",
        "names": "Sample A,\n",
        "long": "".join(f"key {number};value\n" for number in range(60)),
        "labview": "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\n***End_of_Header***\t\n\t\n",
    }.items():
        yield f"above: {name}", Shape((above + PLAIN).encode())
    for name, below in {
        "text": "End of test\n",
        "blank and text": "\nMaximum,12.3\n",
        "blank": "\n\n\n",
        "commas": ",\n,\n",
    }.items():
        yield f"below: {name}", Shape((PLAIN + below).encode())
    for mark in ("# ", "#", "% ", "// "):
        yield f"comment {mark}", Shape((f"{mark}written by hand\n{mark}{PLAIN}").encode())
    yield "commented row", Shape(PLAIN.replace("\n0.0,0.12\n", "\n#9.0,0.12\n0.0,0.12\n").encode())
    for cell in ("NaN", "nan", "-", "n/a", "", "#N/A"):
        yield (
            f"first row {cell!r}",
            Shape(
                f"force_N,travel_mm,n\n{cell},{cell},0\n".encode()
                + table(["1"] * 3, [FORCE, TRAVEL, range(26)]).split("\n", 1)[1].encode()
            ),
        )
    yield "last row NaN", Shape((PLAIN + "NaN,NaN\n").encode())
    yield "row of NaN within", Shape(PLAIN.replace("\n0.0,0.12\n", "\nNaN,NaN\n0.0,0.12\n").encode())


def monitors() -> Iterator[tuple[str, Shape]]:
    """Yield lines of boards."""
    yield (
        "serial monitor",
        Shape(
            "".join(
                f"12:34:{v:06.3f} -> {line}\n" for v, line in zip((0.0, *TIME), PLAIN.splitlines(), strict=False)
            ).encode()
        ),
    )
    yield "serial banner", Shape(("\x1b[0;32mboot\x1b[0m\nHX711 ready\n\n" + PLAIN).encode())


def chosen() -> Iterator[tuple[str, Shape]]:
    """Yield columns that flags choose."""
    yield (
        "named",
        Shape(
            two("Last, z [N]", "Pfad (unten), mm", delimiter="\t").encode(), "force=Last, z [N],travel=Pfad (unten), mm"
        ),
    )
    yield "named without units", Shape(two("Gewicht [N]", "Pfad [mm]").encode(), "force=Gewicht,travel=Pfad")
    yield (
        "two travels",
        Shape(
            table(
                ["Time (s)", "Force (N)", "Crosshead (mm)", "Displacement (mm)"], [TIME, FORCE, TRAVEL + 1, TRAVEL]
            ).encode(),
            "travel=Displacement",
        ),
    )
    yield (
        "two travels by number",
        Shape(
            table(["Force (N)", "Crosshead (mm)", "Displacement (mm)"], [FORCE, TRAVEL + 1, TRAVEL]).encode(),
            "travel=3",
        ),
    )
    yield "no header", Shape(ROWS.encode(), "force=1,travel=2")
    yield (
        "no header, tabs and commas",
        Shape(two(delimiter="\t", cell=comma).split("\n", 1)[1].encode(), "travel=2,force=1"),
    )
    yield "no header, lines above", Shape(("machine 7\nwritten today\n\n" + ROWS).encode(), "force=1,travel=2")
    yield "unknown header by number", Shape(two("Channel A [kN]", "Channel B [mm]", F=1e3).encode(), "force=1,travel=2")
    yield (
        "unknown header and units below",
        Shape(("A,B\nkN,mm\n" + two(F=1e3).split("\n", 1)[1]).encode(), "force=1,travel=2"),
    )


def workbooks() -> Iterator[tuple[str, Shape]]:
    """Yield workbooks."""
    labels = ["Time (s)", "Travel (mm)", "Force (N)"]
    data = sheet(labels, TIME, TRAVEL, FORCE)
    about = [["Operator", "Smith"], ["Height", 70.0], []]
    yield "workbook", Shape(workbook({"Data": data}), suffix="xlsx")
    yield "workbook, lines above", Shape(workbook({"Data": about + data}), suffix="xlsx")
    yield (
        "workbook, units below",
        Shape(workbook({"Data": [["Time", "Travel", "Force"], ["s", "mm", "N"], *data[1:]]}), suffix="xlsx"),
    )
    yield "workbook, from C3", Shape(workbook({"Data": [[], [], *([None, None, *row] for row in data)]}), suffix="xlsx")
    commented = [*data[:2], ["#9.0", *data[1][1:]], *data[2:]]
    yield "workbook, commented row", Shape(workbook({"Data": commented}), suffix="xlsx")
    yield "workbook, two sheets", Shape(workbook({"About": about, "Data": data}), suffix="xlsx")
    yield (
        "workbook, hidden sheet",
        Shape(workbook({"Old": sheet(labels, TIME, TRAVEL, 2 * FORCE), "Data": data}, hidden="Old"), suffix="xlsx"),
    )
    yield "workbook, numbers as text", Shape(workbook({"Data": [list(map(str, row)) for row in data]}), suffix="xlsx")
    yield (
        "workbook, decimal commas as text",
        Shape(workbook({"Data": [list(map(comma, row)) for row in data]}), suffix="xlsx"),
    )
    yield "workbook, Japanese", Shape(workbook({"データ": sheet(LANGUAGES["ja"], TIME, TRAVEL, FORCE)}), suffix="xlsx")
    yield (
        "workbook, by number",
        Shape(workbook({"Data": sheet(["A", "B", "C"], TIME, TRAVEL, FORCE)}), "force=3,travel=2", suffix="xlsx"),
    )
    yield "workbook named csv", Shape(workbook({"Data": data}))


SHAPES = {
    "plain": Shape(PLAIN.encode()),
    **dict(itertools.chain(numbers(), encodings(), headers(), beside(), monitors(), chosen(), workbooks())),
}
"""Every shape by its name."""

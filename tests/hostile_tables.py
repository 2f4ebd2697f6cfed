"""Hostile tables: shapes of a clean curve that are damaged, contradict themselves, or are no tables at all."""

import io
import random
import zipfile

import numpy as np
from export_shapes import FORCE, SHAPES, TRAVEL, Shape, comma, table, two

_WORDS = [
    "N",
    "mm",
    "kN",
    "Force (N)",
    "Travel (mm)",
    "nan",
    "1e999",
    "-",
    "1,500",
    "1.500,5",
    '"',
    "'",
    "\t",
    ";",
    ",",
    "(",
    "[",
]
_WORDS += [
    "[" * 300,
    " " * 5000,
    "9" * 5000,
    "\u0661",
    "\ufeff",
    "\0",
    "\x1b[31m",
    "=1+1",
    "unit: kN",
    "# ",
    "\r",
    "1 N",
    "12:00:00 -> ",
]
_LABELS = [
    "force_N",
    "travel_mm",
    "force_kN",
    "Travel (um)",
    "Force",
    "Travel",
    "Zeit",
    "x",
    "F",
    "t",
    "Load rate",
    "",
    "1",
    "(",
    "N",
    "mm",
]


def damaged(seed: int) -> Shape:
    """Return a shape in which bytes, lines or cells are changed at random."""
    draw = random.Random(seed)
    shape = draw.choice(list(SHAPES.values()))
    content = bytearray(shape.content)
    for _ in range(draw.randint(1, 6)):
        at = draw.randrange(len(content) + 1)
        how = draw.randrange(6)
        if how == 0:
            content[at : at + draw.randint(1, 40)] = b""
        elif how == 1:
            content[at:at] = draw.randbytes(draw.randint(1, 8))
        elif how == 2:
            content[at:at] = draw.choice(_WORDS).encode("utf-8", "replace")
        elif how == 3:
            content = content[:at] or content
        elif how == 4:
            other = draw.choice(list(SHAPES.values())).content
            content[at:at] = other[draw.randrange(len(other)) :]
        else:
            lines = content.split(b"\n")
            draw.shuffle(lines) if draw.random() < 0.3 else lines.insert(draw.randrange(len(lines)), draw.choice(lines))
            content = bytearray(b"\n".join(lines))
    return shape._replace(content=bytes(content))


def invented(seed: int) -> Shape:
    """Return lines of labels, numbers and rubbish."""
    draw = random.Random(seed)
    delimiter = draw.choice([",", ";", "\t", " ", "|", "  "])
    width = draw.randint(1, 6)
    lines = [delimiter.join(draw.choice(_LABELS + _WORDS) for _ in range(width)) for _ in range(draw.randint(0, 3))]
    for row in range(draw.randint(0, 40)):
        cells = [
            draw.choice([f"{row * 0.1:.3f}", f"{row**1.5}", f"{row},{row}", draw.choice(_WORDS)]) for _ in range(width)
        ]
        lines.append(delimiter.join(cells))
    columns = draw.choice([None, "force=1,travel=2", "force=F,travel=x", "travel=9", "time=1"])
    return Shape(
        draw.choice(["\n", "\r\n", "\r", "\n\n"])
        .join(lines)
        .encode(draw.choice(["utf-8", "utf-16", "cp1252"]), "replace"),
        columns,
    )


def contradictory() -> list[Shape]:
    """Return tables that each say two things, by themselves or with flags: each is to be refused."""
    rows = two().split("\n", 1)[1]
    fine = [f"{value:.3f}" for value in FORCE]
    texts = [
        two("Force (N)", "Travel (mm)").replace("\n", "\nkN,mm\n", 1),  # header and row of units
        two("Force (dyn)", "Travel (mm)"),
        two("Force (mm)", "Travel (N)"),
        two("Force (MN)", "Travel (mm)"),
        two("Force (N/s)", "Travel (mm)"),
        two("Force (N)", "Travel (%)"),
        f"Force,Travel\nN,furlong\n{rows}",
        f"Force,Travel\npounds,\nmm,N\n{rows}",
        "Units,US customary\n" + two("Force", "Travel"),
        "Force unit: stone\n" + two("Force", "Travel"),
        table(
            ["force_N", "travel_mm"],
            [
                [f"{v + 1.001:.3f}".replace(".", ",") for v in FORCE],
                [f"{v + 1.001:.3f}".replace(".", ",") for v in TRAVEL],
            ],
            ";",
        ),
        table(["force_N", "travel_mm"], [map(comma, fine), TRAVEL], ";"),  # two decimal signs
        table(["force_N", "travel_mm"], [[f"{1.0 + v:.3f}".replace(".", ",") for v in FORCE], TRAVEL], ";"),
        two(cell=comma),  # decimal commas between commas
        two("force_N", "force_kgf"),
        table(["force_N", "travel_mm", "travel_mm"], [FORCE, TRAVEL, 2 * TRAVEL]),
        table(["force_N", "stroke_mm", "position_mm"], [FORCE, TRAVEL, 2 * TRAVEL]),
        two("Force [N]", "Travel [mm]", cell=lambda v: f"{v} kg"),
        two("Test Time Force (N)", "Travel (mm)", delimiter=" "),
        rows,
        two("A", "B"),
        two("travel_mm", "force_N"),  # swapped names: a force that rises ever less
        f"{two()}\n{rows}",  # numbers after a blank line
    ]
    with_flags = [
        (two("Force (N)", "Travel (mm)"), None, "force=kN"),
        (two("Force (N)", "Travel (mm)"), "force=Travel,travel=Force", None),
        (two("Force (N)", "Travel (mm)"), "force=3", None),
        (two("Force (N)", "Travel (mm)"), "force=Kraft", None),
        (two("Force (N/s)", "Travel (mm)"), "force=1", None),
        (two("Zeit (s)", "Travel (mm)"), "force=Zeit", None),
    ]
    shapes = [(text, None, None) for text in texts] + with_flags
    return [Shape(text.encode(), columns, units) for text, columns, units in shapes]


def bombs() -> dict[str, Shape]:
    """Return files that would take all memory or time if they were believed."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as book:
        book.writestr("xl/workbook.xml", b" " * 200 * 2**20)
    clean = SHAPES["workbook"].content

    def changed(old: bytes, new: bytes) -> bytes:
        made = io.BytesIO()
        with zipfile.ZipFile(io.BytesIO(clean)) as book, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as other:
            for name in book.namelist():
                other.writestr(name, book.read(name).replace(old, new))
        return made.getvalue()

    most = 16 * 2**20
    numbers = b"force_N,travel_mm\n" + b"1.5,2.5\n" * (most // 8 - 10)
    return {
        "zip": Shape(out.getvalue(), suffix="xlsx"),
        "far cell": Shape(changed(b'r="C27"', b'r="XFD1048576"'), suffix="xlsx"),
        "rows": Shape(changed(b"</sheetData>", b"<row/>" * 3_000_000 + b"</sheetData>"), suffix="xlsx"),
        "entities": Shape(
            changed(b"<worksheet", b'<!DOCTYPE a [<!ENTITY b "' + b"c" * 10**6 + b'">]><worksheet'), suffix="xlsx"
        ),
        "numbers": Shape(numbers[:most]),
        "labels": Shape(b"".join(b"a%d,b%d\n" % (n, n) for n in range(900_000))[:most]),
        "quotes": Shape(b'"' * most),
        "words": Shape(b"unit " * (most // 5)),
        "half Unicode": Shape(b"\xff\xfe" + b"\xd8" * (most - 2)),
        "bands": Shape(np.random.default_rng(1).bytes(most)),
        "header": Shape(b",".join(b"force_N" for _ in range(most // 9)) + b"\n" + b"1," * 1000),
        "clocks": Shape(b"12:00:00 -> \n" * (most // 13)),
    }

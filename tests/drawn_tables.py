"""Tables of compression tests drawn at random: units, languages and layouts of many machines, with the curve in each.

The units, words and layouts are those of makers' manuals, not those of the reader, and so is what one unit is worth.
"""

import random
from dataclasses import dataclass

import numpy as np

# one unit in N or mm: international pound 0.45359237 kg, inch 25.4 mm, standard gravity 9.80665 m/s^2
KILOGRAM = 9.80665
POUND = 0.45359237 * KILOGRAM
FORCES = {
    "N": 1.0, "kN": 1e3, "mN": 1e-3, "cN": 1e-2, "daN": 10.0, "kgf": KILOGRAM, "gf": 1e-3 * KILOGRAM, "lbf": POUND,
    "ozf": POUND / 16.0, "kg": KILOGRAM, "g": 1e-3 * KILOGRAM, "lbs": POUND, "Newton": 1.0, "KN": 1e3,
}  # fmt: skip
TRAVELS = {
    "mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "µm": 1e-3, "in": 25.4, "inch": 25.4, "mil": 25.4e-3, "MM": 1.0,
    "microns": 1e-3,
}  # fmt: skip
NO_FORCES = ["V", "mV", "counts", "%", "MPa", "psi", "dyn", "N/mm", "bits", "mV/V", "kPa", "pdl", "tonf", "lbf/in"]
NO_TRAVELS = ["%", "rev", "mm/s", "deg", "steps", "V", "strain", "mm/mm", "px", "turns", "in/min", "fathom"]
NAMES = [
    ("Force", "Travel"), ("Load", "Extension"), ("Load", "Displacement"), ("Force", "Distance"), ("Kraft", "Weg"),
    ("Standardkraft", "Standardweg"), ("Prüfkraft", "Traversenweg"), ("Charge", "Enfoncement"), ("Effort", "Course"),
    ("Fuerza", "Desplazamiento"), ("Carga", "Recorrido"), ("Forza", "Spostamento"), ("Carico", "Corsa"),
    ("Força", "Deslocamento"), ("Kracht", "Verplaatsing"), ("荷重", "変位"), ("试验力", "位移"), ("하중", "변위"),
    ("Compressive load", "Compressive extension"), ("Normal force", "Gap"), ("Axial Force", "Axial Displacement"),
    ("Load Cell", "Crosshead"), ("Test force", "Stroke"), ("Fz", "z"), ("LOAD", "POSITION"),
    ("Druckkraft", "Stauchung"),
]  # fmt: skip
LABELS = [
    "{name} ({unit})", "{name} [{unit}]", "{name}_{unit}", "{name}/{unit}", "{name} in {unit}", "{name}, {unit}",
    "{name}..{unit}.", "{name} <{unit}>", "{name}({unit})", "{name} {unit}", "{name}: {unit}", "{name} - {unit}",
]  # fmt: skip
UNIT_HEADERS = ["Unit", "Units", "Einheit", "Unité", "unit", "UNIT", "Unit of measure", ""]
STATEMENTS = [
    ["{name} unit", "{unit}"], ["{name} unit: {unit}"], ["{name} Units", "{unit}"], ["Unit of {name}: {unit}"],
    ["{name} unit = {unit}"], ["Unit ({name})", "{unit}"],
]  # fmt: skip
MENTIONS = ["Load range: 5 {unit}", "Sensor (1 {unit}), no. 17", "full scale 2.5{unit}", "Preload 0.1 {unit}"]


@dataclass
class DrawnTable:
    """A table with its flags, its curve [mm, N], and whether it `must` be "read", "refused", or may be either."""

    text: str
    travel: np.ndarray
    force: np.ndarray
    digits: tuple[float, float]
    columns: str | None = None
    units: str | None = None
    encoding: str = "utf-8"
    must: str = ""


@dataclass
class _Column:
    """A column of numbers: its name, unit, what one unit is worth, and how the file says the unit."""

    name: str
    unit: str
    worth: float
    how: str
    key: str
    label: str = ""


class _Draw:
    """One draw of a table."""

    def __init__(self, seed):
        self.draw = random.Random(seed)
        self.must = ""
        self.above = []
        self.below = []
        self.results_above = []
        self.flag_units = {}
        self.flag_columns = {}

    def column(self, key, name, units, others, default):
        """Return a column, with the lines that say its unit."""
        draw = self.draw
        unit = draw.choice(list(units))
        hows = ["label"] * 4 + ["below", "column", "number", "line", "flag", "mention", "sibling", "foot", "no unit"]
        how = draw.choice(hows)
        column = _Column(name, unit, units[unit], how, key, name)
        if how == "label":
            column.label = draw.choice(LABELS).format(name=name, unit=unit)
        elif how == "line":
            said = draw.choice(STATEMENTS)
            self.above.append([part.format(name=name, unit=unit) for part in said])
        elif how == "flag":
            self.flag_units[key] = unit
        elif how == "mention":
            self.above.append([draw.choice(MENTIONS).format(unit=unit)])
        elif how == "foot":
            self.below.append([f"{name} unit: {unit}"])
        elif how == "no unit":  # a column that holds no force, or no travel
            column.unit = draw.choice(others)
            column.label = draw.choice(["{name} ({unit})", "{name} [{unit}]", "{name}_{unit}"]).format(
                name=name, unit=column.unit
            )
            self.flag_columns[key] = draw.choice([column.label, name]) if draw.random() < 0.8 else ""
            self.must = "refused"
        if how in ("mention", "sibling", "foot") and column.worth == units[default]:
            column.how = "default"
        return column


def drawn_table(seed):
    """Return the table of a seed."""
    own = _Draw(seed)
    draw = own.draw
    rows = draw.randint(20, 60)
    travel = np.linspace(0.0, draw.uniform(1.5, 5.0), rows)
    depth = np.clip(travel - 0.1 * travel[-1], 0.0, None) / 2.0
    force = draw.uniform(0.5, 4.0) * 4.0 / 3.0 * np.sqrt(draw.uniform(20.0, 60.0)) * depth**1.5
    force_name, travel_name = draw.choice(NAMES)
    columns = [
        own.column("force", force_name, FORCES, NO_FORCES, "N"),
        own.column("travel", travel_name, TRAVELS, NO_TRAVELS, "mm"),
    ]
    values = [force, travel]
    written = [
        [f"{value:.{decimals}f}" for value in of / column.worth]
        for of, column in zip(values, columns, strict=True)
        for decimals in [max(0, int(np.ceil(4.0 - np.log10(max(of[-1] / column.worth, 1e-12)))))]
    ]
    digits = tuple(
        0.6 * column.worth * 10.0 ** -len(cells[0].partition(".")[2])
        for column, cells in zip(columns, written, strict=True)
    )
    comma = draw.random() < 0.25
    delimiter = draw.choice([";", "\t"]) if comma else draw.choice([",", ";", "\t", ",", "|"])
    if comma:
        written = [[cell.replace(".", ",") for cell in cells] for cells in written]
    _name_columns(own, columns)
    header, body, units_row = _laid_out(own, columns, written, rows)
    lines = _with_segments(own, header, units_row, body)
    _add_results(own, columns, force)
    _contradict(own, columns)
    before = [["Operator", "Smith"], ["Test", f"{seed}"], *own.above]
    draw.shuffle(before)
    gap = [[""]] if draw.random() < 0.5 else []
    every = [*before, *own.results_above, *gap, *lines, *([[""], *own.below] if own.below else [])]
    text = "\n".join(delimiter.join(_quoted(cell, delimiter) for cell in row) for row in every) + "\n"
    flags = [",".join(f"{key}={value}" for key, value in of.items()) for of in (own.flag_columns, own.flag_units)]
    encoding = draw.choice(["utf-8", "utf-8-sig", "utf-16"])
    hows = {column.how for column in columns}
    if not own.must and hows <= {"label", "below", "column", "number", "line", "flag", "default"}:
        own.must = "read"
    return DrawnTable(
        text, travel, force, (digits[0], digits[1]), flags[0] or None, flags[1] or None, encoding, own.must
    )


def _name_columns(own, columns):
    """Give some columns names that no machine has, which flags name."""
    for column in columns:
        if column.how == "no unit" and own.flag_columns.get(column.key) == "":
            del own.flag_columns[column.key]
        elif column.how in ("label", "column", "below", "number") and own.draw.random() < 0.2:
            other = own.draw.choice(["Channel A", "Signal 7", "Y", "Messwert", "AI0"]) + column.key[0]
            column.label = column.label.replace(column.name, other)
            own.flag_columns[column.key] = own.draw.choice([column.label, other])


def _laid_out(own, columns, written, rows):
    """Return the header, the rows, and a row of units below the header, if there is one."""
    draw = own.draw
    parts = []
    has_row = any(column.how == "below" for column in columns)
    for column, cells in zip(columns, written, strict=True):
        below = column.unit if column.how == "below" else ""
        bracketed = draw.choice(["{}", "({})", "[{}]"]).format(below) if below else ""
        labels, of_rows = [column.label], [[cell] for cell in cells]
        if column.how == "number":
            of_rows = [[f"{cell} {column.unit}"] for cell in cells]
        elif column.how == "column":
            labels.append(draw.choice(UNIT_HEADERS))
            of_rows = [[cell, column.unit] for cell in cells]
        elif column.how == "sibling":
            labels.append(f"Peak {column.name} ({column.unit})")
            of_rows = [[cell, "0"] for cell in cells]
        parts.append((labels, of_rows, [bracketed] + [""] * (len(labels) - 1)))
    if draw.random() < 0.5:
        parts.append((["Remark"], [["ok"]] * rows, [""]))
    if draw.random() < 0.4:
        parts.append((["Temperature (°C)"], [["21.5".replace(".", written[0][0][1:2] or ".")]] * rows, [""]))
    draw.shuffle(parts)
    if draw.random() < 0.5:
        parts.insert(0, ([draw.choice(["No.", "Point", ""])], [[f"{row + 1}"] for row in range(rows)], [""]))
    header = [label for labels, _, _ in parts for label in labels]
    body = [[cell for _, of_rows, _ in parts for cell in of_rows[row]] for row in range(rows)]
    return header, body, [cell for _, _, below in parts for cell in below] if has_row else []


def _with_segments(own, header, units_row, body):
    """Return the lines of a table, whose header may come again for each of its segments."""
    head = [header, *([units_row] if units_row else [])]
    if own.draw.random() < 0.15:
        own.must = own.must or "either"
        third = len(body) // 3
        gap = [[""], ["Segment", "next"]] if own.draw.random() < 0.5 else [[""]]
        return [*head, *body[:third], *gap, *head, *body[third : 2 * third], *gap, *head, *body[2 * third :]]
    return [*head, *body]


def _add_results(own, columns, force):
    """Add a table of results in units of its own, above or below the curve."""
    draw = own.draw
    if draw.random() < 0.3:
        units = [draw.choice(["N", "kN"]), draw.choice(["mm", "in"])]
        labels = ["Specimen", *(f"{column.name} ({unit})" for column, unit in zip(columns, units, strict=True))]
        largest = f"{force[-1]:.3f}"
        results = [["Results"], labels, ["1", largest, "3"]]
        results += draw.choice([[], [["Mean", largest, "3"], ["S.D.", "0", "0"]]])
        where = draw.choice(["above", "below"])
        own.must = own.must or "either"
        if where == "above":
            own.results_above = [[""], *results, *draw.choice([[], [[""]]])]
        else:
            own.below += results


def _contradict(own, columns):
    """Say another unit of a column in a second place."""
    stated = [column for column in columns if column.how not in ("mention", "sibling", "default")]
    if stated and own.draw.random() < 0.12:
        column = own.draw.choice(stated)
        other = own.draw.choice([unit for unit in ("kgf", "mil", "N", "um") if _worth(unit) != column.worth])
        if (other in FORCES) == (column.key == "force"):
            own.above.append([f"{column.name} unit: {other}"])
            own.must = "refused"


def _worth(unit):
    return {**FORCES, **TRAVELS}[unit]


def _quoted(cell, delimiter):
    return f'"{cell}"' if delimiter in cell else cell

"""The tables of a design before it is constructed: all settings are applied first, and then checked together.

So values that follow from other keys are derived after the last setting: the numbers of the process, the size of a
whole fruit, and default targets.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from sensor.design.design_file import (
    TABLE_TYPES,
    design_as_mapping,
    design_from_mapping,
    every_key,
    not_a_table,
    parsed_setting,
    refuse_typed_noise,
    table_as_record,
)
from sensor.design.parameters import TABLES, Design
from sensor.design.processes import PROCESSES, check_process_name, read_process_file
from sensor.gone import refuse_gone
from sensor.quantity import InputError, unknown_name, validation_error

_PROCESS = "print.process"
_PROCESS_FILE = "print.process_file"
_PROCESS_SETTINGS = (_PROCESS_FILE, "print", "printer")
"""The key and the tables that define a design's own processes."""


@dataclass(frozen=True, kw_only=True)
class DesignTables:
    """The tables of a design, and its own print processes by name; `print.process` selects one of them.

    The table `printer` holds settings of this process.
    """

    tables: Mapping[str, Any]
    own: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def from_file(cls, data: Mapping[str, Any], folder: Path) -> "DesignTables":
        """Return the tables of a design file in a folder, with the processes of the process file that it names.

        Raises InputError for a process file that cannot be used, and for a process file beside a table `printer`.
        """
        tables = {key: value for key, value in data.items() if key != "printer"}
        given = tables.get("print")
        printing = dict(given) if isinstance(given, Mapping) else {}
        file_name = printing.pop("process_file", None)
        process = printing.get("process")
        if "printer" in data:
            if not isinstance(data["printer"], Mapping):
                raise not_a_table("printer", data["printer"])
            if file_name is not None:
                raise validation_error(
                    _PROCESS_FILE, file_name, "", "left out if [printer] is given", "keep one of the two"
                )
            check_process_name(process)
            return cls(tables=tables, own={str(process): data["printer"]})
        if file_name is None:
            return cls(tables=tables)
        own = _processes_of(file_name, folder)
        if process is not None:
            _refuse_unlisted(process, own, file_name)
        return cls(tables={**tables, "print": printing}, own=own)

    @classmethod
    def from_design(cls, design: Design) -> "DesignTables":
        """Return the tables of a design."""
        return cls.from_file(design_as_mapping(design), Path())

    def changed(self, settings: Mapping[str, object]) -> "DesignTables":
        """Return the tables with settings TABLE.KEY applied; None unsets a key, or a whole table such as `reading`.

        The path of a process file is relative to the working folder. The order of the settings does not matter, because
        tables are unset before keys are set. Raises InputError for an unknown name.
        """
        refuse_gone(*settings)
        for name, value in settings.items():
            _refuse_unknown(name, value)
        tables = {table: values for table, values in self.tables.items() if table not in settings or table == "name"}
        for name, value in settings.items():
            table, _, key = name.partition(".")
            if name == "name":
                tables[name] = value
            elif key:
                held = tables.get(table, {})
                if not isinstance(held, Mapping):
                    raise not_a_table(table, held)
                if value is not None:
                    tables[table] = {**held, key: value}
                elif key in held:
                    tables[table] = {other: of_other for other, of_other in held.items() if other != key}
        if settings.keys().isdisjoint(_PROCESS_SETTINGS):
            return DesignTables(tables=tables, own=self.own)
        return self._with_other_processes(tables, settings)

    def _with_other_processes(self, tables: dict[str, Any], settings: Mapping[str, object]) -> "DesignTables":
        """Return changed tables with the processes of the file that the settings name; without any if they unset it."""
        given = tables.get("print", {})
        printing = dict(given) if isinstance(given, Mapping) else {}
        file_name = printing.pop("process_file", None)
        process = printing.get("process")
        own: Mapping[str, Mapping[str, Any]] = {}
        if file_name is not None:
            own = _processes_of(file_name, Path())
            if settings.get(_PROCESS) is not None:
                _refuse_unlisted(process, own, file_name)
            elif process not in [*own]:  # a process of the former process file
                printing.pop("process", None)
        elif process in [*self.own] and _PROCESS not in settings:  # its process file is unset
            del printing["process"]
        return DesignTables(tables={**tables, "print": printing}, own=own)

    def design(self, settings: Mapping[str, object] | None = None) -> Design:
        """Return the design of the tables with settings as in `changed`; raises InputError for an invalid design."""
        changed = self.changed(settings) if settings else self
        if "readout" in changed.tables:
            refuse_typed_noise(changed.tables.get("reading"))
        data = {**changed.tables}
        for table, record in self._records.items():
            if changed.tables.get(table) is self.tables[table]:
                data[table] = record
        return design_from_mapping(changed._with_process(data))

    @cached_property
    def _records(self) -> dict[str, Any]:
        """Return the records of the tables that are valid without settings, so that a study makes each only once."""
        records = {}
        for table in TABLE_TYPES.keys() & self.tables.keys():
            try:
                records[table] = table_as_record(table, self.tables[table])
            except InputError:  # it may become valid with the keys that a point of a study sets
                continue
        return records

    def _with_process(self, data: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the tables with the numbers of the selected own process in the table `printer`.

        A single own process need not be named. Raises InputError for a name that is neither an own process nor a known
        one, and for settings of [printer] beside a known process.
        """
        printing = self.tables.get("print", {})
        process = printing.get("process") if isinstance(printing, Mapping) else None
        if process is None and len(self.own) == 1:
            (process,) = self.own
        settings = data.get("printer", {})
        if isinstance(process, str) and process in self.own:
            printer = {**self.own[process], **settings}
            return {**data, "print": {**printing, "process": process}, "printer": printer}
        if self.own and process not in [*PROCESSES]:
            bound = f"one of {', '.join([*self.own, *PROCESSES])}"
            raise validation_error(_PROCESS, process, "", bound, "choose one whose numbers are known")
        for key, value in settings.items():
            name = f"printer.{key}"
            bound = "left out for a process that comes with the program"
            raise validation_error(name, value, "", bound, "set print.E_MPa, or give a process of your own")
        return data


def settings_of_texts(texts: Mapping[str, str]) -> dict[str, object]:
    """Return settings from texts: values are TOML, bare words are text, and an empty text unsets the key."""
    return {name: text if name == "name" else parsed_setting(text) if text else None for name, text in texts.items()}


def _refuse_unknown(name: str, value: object) -> None:
    """Raise InputError for a setting without a known key.

    A whole table can only be unset, and a key of [printer] can only be set.
    """
    table, _, key = name.partition(".")
    known = table in TABLES and bool(key)
    if value is None:
        known = name in TABLES or name in every_key()
    if not known and name != "name":
        raise unknown_name("setting", name, ["name", *every_key()])


def _processes_of(file_name: object, folder: Path) -> Mapping[str, Mapping[str, Any]]:
    """Return the processes by name from a file in a folder; raises InputError if it has none, or cannot be used."""
    if not isinstance(file_name, str) or not file_name or not file_name.isprintable():
        raise validation_error(_PROCESS_FILE, file_name, "", "the path of a TOML file", "write it in quotes")
    own = read_process_file(folder / file_name)
    if not own:
        _refuse_unlisted(None, own, file_name)
    return own


def _refuse_unlisted(process: object, own: Mapping[str, Any], file_name: str) -> None:
    """Raise InputError for the name of a process that is not in the process file."""
    if process not in [*own]:
        bound = f"one of those in {Path(file_name).name!r}: {', '.join(own) or 'none'}"
        raise validation_error(_PROCESS, process, "", bound, "name one with print.process")

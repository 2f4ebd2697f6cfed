"""The tables of a design before it is built. All settings are applied first, and are then checked together.

The order matters for values that follow from other keys: the numbers of the process, the size of a whole fruit, and
default targets. They are derived after the last setting.
"""

from collections.abc import Iterable, Mapping
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
    parse_setting,
    refuse_given_noise,
    table_as_record,
)
from sensor.design.parameters import TABLES, Design
from sensor.design.processes import PROCESSES, check_process_name, read_process_file
from sensor.gone import refuse_removed
from sensor.quantity import InputError, unknown_name, validation_error

_PROCESS = "print.process"
_PROCESS_FILE = "print.process_file"
_PROCESS_SETTINGS = (_PROCESS_FILE, "print", "printer")
"""The key and the tables that define the custom processes of a design."""


@dataclass(frozen=True, kw_only=True)
class DesignTables:
    """The tables of a design by name, as in its file, and its custom print processes.

    `custom_processes` maps the name of each custom process to its numbers; `print.process` selects one of them. The
    table `printer` in `tables` holds only settings that change numbers of the selected process.
    """

    tables: Mapping[str, Any]
    custom_processes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def from_file(cls, data: Mapping[str, Any], folder: Path) -> "DesignTables":
        """Return the tables of a design file with the content `data`, and its custom print processes.

        The table `printer` defines a single process, which `print.process` names. A process file, whose path is
        relative to `folder`, may define several. Raises InputError if the design file has both, if the process file
        cannot be used, or if `print.process` does not name one of the processes.
        """
        tables = {key: value for key, value in data.items() if key != "printer"}
        # An invalid table [print] stays in `tables`, and is reported when the design is built.
        print_table = _print_table(tables)
        file_name = print_table.pop("process_file", None)
        process = print_table.get("process")
        if "printer" in data:
            if not isinstance(data["printer"], Mapping):
                raise not_a_table("printer", data["printer"])
            if file_name is not None:
                raise validation_error(
                    _PROCESS_FILE, file_name, "", "left out if [printer] is given", "keep one of the two"
                )
            check_process_name(process)
            return cls(tables=tables, custom_processes={str(process): data["printer"]})
        if file_name is None:
            return cls(tables=tables)
        processes = _read_processes(file_name, folder)
        if process is not None:
            _refuse_unlisted(process, processes, file_name)
        return cls(tables={**tables, "print": print_table}, custom_processes=processes)

    @classmethod
    def from_design(cls, design: Design) -> "DesignTables":
        """Return the tables of an existing design."""
        return cls.from_file(design_as_mapping(design), Path())

    def with_settings(self, settings: Mapping[str, object]) -> "DesignTables":
        """Return new tables with these settings changed. The name of a setting is TABLE.KEY.

        The value None removes a key, or a whole table such as `reading`. The path of a process file is relative to the
        working folder. The order of the settings does not matter, because tables are removed before keys are set.
        Raises InputError for an unknown name.
        """
        refuse_removed(*settings)
        for name, value in settings.items():
            _refuse_unknown(name, value)
        # A setting with the name of a table can only remove it. `name`, the name of the design, is not a table.
        tables = {table: values for table, values in self.tables.items() if table not in settings or table == "name"}
        for name, value in settings.items():
            table, _, key = name.partition(".")
            if name == "name":
                tables[name] = value
            elif key:  # otherwise the setting removes a table, which is done above
                _change_key(tables, table, key, value)
        if settings.keys().isdisjoint(_PROCESS_SETTINGS):
            return DesignTables(tables=tables, custom_processes=self.custom_processes)
        return self._with_other_processes(tables, settings)

    def _with_other_processes(self, tables: dict[str, Any], settings: Mapping[str, object]) -> "DesignTables":
        """Return `tables`, to which `settings` have been applied, with the custom processes that they define.

        The custom processes are the processes of the process file; without a process file, there are none. The key
        `print.process` is dropped if it selects a process of a process file that is no longer used. Raises InputError
        if the process file cannot be used, or if the settings select a process that is not in it.
        """
        print_table = _print_table(tables)
        file_name = print_table.pop("process_file", None)
        process = print_table.get("process")
        processes: Mapping[str, Mapping[str, Any]] = {}
        if file_name is not None:
            processes = _read_processes(file_name, Path())
            if settings.get(_PROCESS) is not None:
                _refuse_unlisted(process, processes, file_name)
            elif not _is_listed(process, processes):
                print_table.pop("process", None)  # this process belongs to the previous process file
        elif _is_listed(process, self.custom_processes) and _PROCESS not in settings:
            # The settings have removed the process file that contains this process.
            del print_table["process"]
        if isinstance(tables.get("print", {}), Mapping):  # an invalid table stays, and is reported with the design
            tables["print"] = print_table
        return DesignTables(tables=tables, custom_processes=processes)

    def design(self, settings: Mapping[str, object] | None = None) -> Design:
        """Build the design from the tables, after changing `settings`, whose names are TABLE.KEY.

        Raises InputError for an unknown name, or if the design is invalid.
        """
        changed = self.with_settings(settings) if settings else self
        if "readout" in changed.tables:
            # A record below always has a noise, so only the table shows whether the noise was given.
            refuse_given_noise(changed.tables.get("reading"))
        data = {**changed.tables}
        # Unchanged tables have been checked already, so their records are used again.
        for table, record in self._records.items():
            if changed.tables.get(table) is self.tables[table]:
                data[table] = record
        return design_from_mapping(changed._with_process(data))

    @cached_property
    def _records(self) -> dict[str, Any]:
        """Return the records of the tables that are valid without settings, so that a study checks them only once."""
        records = {}
        for table in TABLE_TYPES.keys() & self.tables.keys():
            try:
                records[table] = table_as_record(table, self.tables[table])
            except InputError:  # the settings of a study may make it valid
                continue
        return records

    def _with_process(self, data: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the tables `data` with all numbers of the selected custom process in the table `printer`.

        In `data`, this table holds only the settings that change numbers of the process. If the design has only one
        custom process, it need not be selected. Raises InputError for the name of an unknown process, and for settings
        of [printer] if a built-in process is selected.
        """
        print_table = self.tables.get("print", {})
        process = print_table.get("process") if isinstance(print_table, Mapping) else None
        if process is None and len(self.custom_processes) == 1:
            (process,) = self.custom_processes
        settings = data.get("printer", {})  # numbers that replace those of the selected process
        if isinstance(process, str) and process in self.custom_processes:
            printer = {**self.custom_processes[process], **settings}
            return {**data, "print": {**print_table, "process": process}, "printer": printer}
        if self.custom_processes and not _is_listed(process, PROCESSES):
            bound = f"one of {', '.join([*self.custom_processes, *PROCESSES])}"
            raise validation_error(_PROCESS, process, "", bound, "choose one of these names")
        if settings:
            key, value = next(iter(settings.items()))  # only the first setting is reported
            name = f"printer.{key}"
            bound = "left out for a built-in process"
            raise validation_error(name, value, "", bound, "set print.E_MPa, or define your own process")
        return data


def settings_of_texts(texts: Mapping[str, str]) -> dict[str, object]:
    """Parse settings. A value is TOML, a word without quotes is a string, and an empty value removes the key."""
    settings: dict[str, object] = {}
    for name, text in texts.items():
        if name == "name":  # the name of the design is always text
            settings[name] = text
        else:
            settings[name] = parse_setting(text) if text else None
    return settings


def _change_key(tables: dict[str, Any], table: str, key: str, value: object) -> None:
    """Set a key of a table in `tables`, or remove the key if the value is None.

    The table is replaced by a changed copy, because other designs may share it. Raises InputError if it is not a table.
    """
    old_table = tables.get(table, {})
    if not isinstance(old_table, Mapping):
        raise not_a_table(table, old_table)
    if value is not None:
        tables[table] = {**old_table, key: value}
    elif key in old_table:
        tables[table] = {old_key: old_value for old_key, old_value in old_table.items() if old_key != key}


def _print_table(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of the table [print], which is empty if the table is missing or invalid."""
    print_table = tables.get("print")
    return dict(print_table) if isinstance(print_table, Mapping) else {}


def _refuse_unknown(name: str, value: object) -> None:
    """Raise InputError for a setting with an unknown name.

    The name of a table is allowed only if the table is removed. A key of [printer] can be set, but not removed.
    """
    table, _, key = name.partition(".")
    known = table in TABLES and bool(key)
    if value is None:
        known = name in TABLES or name in every_key()
    if not known and name != "name":
        raise unknown_name("setting", name, ["name", *every_key()])


def _read_processes(file_name: object, folder: Path) -> Mapping[str, Mapping[str, Any]]:
    """Read the custom processes in a process file. The names of the processes are the keys of the result.

    The path is relative to `folder`. Raises InputError if the file cannot be used or has no process.
    """
    if not isinstance(file_name, str) or not file_name or not file_name.isprintable():
        raise validation_error(_PROCESS_FILE, file_name, "", "the path of a TOML file", "write it in quotes")
    processes = read_process_file(folder / file_name)
    if not processes:
        _refuse_unlisted(None, processes, file_name)
    return processes


def _is_listed(process: object, processes: Iterable[str]) -> bool:
    """Return whether the value of `print.process` is one of the names in `processes`."""
    return process in [*processes]  # a list is searched, because an invalid value may not be hashable


def _refuse_unlisted(process: object, processes: Mapping[str, Any], file_name: str) -> None:
    """Raise InputError unless the process is one of the `processes` in the process file."""
    if not _is_listed(process, processes):
        bound = f"one of the processes in {Path(file_name).name!r}: {', '.join(processes) or 'none'}"
        raise validation_error(_PROCESS, process, "", bound, "choose one with print.process")

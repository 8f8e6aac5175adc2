"""Reads CSV files of commands as arrays."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# `setpoint_rate[3]_rad/s`: a name, the index, the unit.
_INDEXED = re.compile(r"(.+)\[(\d+)\](?:_(.+))?")


class Table(Mapping[str, NDArray[Any]]):
    """Columns by name. Indexed columns, ``voltage[0]`` to ``voltage[5]``, are one array with a row per sample; other names are those of
    the file, including the unit: ``time_s``."""

    def __init__(self, columns: dict[str, NDArray[Any]], units: dict[str, tuple[str | None, ...]]) -> None:
        self._columns = columns
        self.units = units
        """Units of indexed columns, if the file has them."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return f"Table({', '.join(f'{name}{list(column.shape)}' for name, column in self.items())})"

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame``, with one column per index: ``voltage[0]``."""
        # pandas and its types are optional.
        pandas = import_module("pandas")
        flat: dict[str, NDArray[Any]] = {}
        for name, column in self.items():
            if column.ndim == 1:
                flat[name] = column
            else:
                flat.update({f"{name}[{place}]": column[:, place] for place in range(column.shape[1])})
        return pandas.DataFrame(flat)


def read_table(path: str | PathLike[str]) -> Table:
    """Reads a CSV file with one header line; columns that are not numeric are text."""
    # Opening a pipe without a writer, or a device, would block.
    if Path(path).exists() and not Path(path).is_file():
        raise OSError(f"{path}: not a regular file")
    with open(path, encoding="utf-8") as file:
        names = file.readline().rstrip("\n").split(",")
        first = file.readline().rstrip("\n").split(",")
    numbers = [place for place, field in enumerate(first) if _is_number(field)]
    columns: list[NDArray[Any]] = [np.empty(0)] * len(names)
    while first != [""]:
        try:
            for places, kind in ((numbers, np.float64), (_others(numbers, len(names)), np.str_)):
                for place, column in zip(places, _columns(path, places, kind)):
                    columns[place] = column
            break
        except ValueError:
            # One of them has text further down.
            numbers = [place for place in numbers if _all_numbers(path, place)]
    table: dict[str, NDArray[Any]] = {}
    units: dict[str, tuple[str | None, ...]] = {}
    sixes: dict[str, list[tuple[NDArray[Any], str | None]]] = {}
    for name, values in zip(names, columns):
        if found := _INDEXED.fullmatch(name):
            sixes.setdefault(found[1], []).append((values, found[3]))
            table.setdefault(found[1], values)
        else:
            table[name] = values
    for name, members in sixes.items():
        table[name] = np.column_stack([values for values, _ in members])
        if any(unit for _, unit in members):
            units[name] = tuple(unit for _, unit in members)
    return Table(table, units)


def _columns(path: str | PathLike[str], places: list[int], kind: type[Any]) -> Any:
    if not places:
        return []
    rows = np.loadtxt(
        path, kind, comments=None, delimiter=",", skiprows=1, usecols=places, ndmin=2, encoding="utf-8", quotechar=None
    )
    return rows.T


def _others(numbers: list[int], count: int) -> list[int]:
    return [place for place in range(count) if place not in numbers]


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _all_numbers(path: str | PathLike[str], place: int) -> bool:
    return all(map(_is_number, _columns(path, [place], np.str_)[0]))

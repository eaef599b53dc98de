"""Histories from files: a table whose columns have names and units, read as strictly as a case."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.laws.loading import Table
from surfacechem.units import parse

TEXTS = {
    "file": "a CSV file beside the case; its first line is like t [s], w_n [um]",
    "csv": "the text of such a file",
    "column": "the column of the values, if not named after the variable",
}
KEYS = tuple(TEXTS)
HEADING = re.compile(r"(?P<name>[A-Za-z]\w*)\s*\[(?P<unit>[^\]]+)\]")
EXAMPLE = '"t [s], w_n [um]"'


def embedded(tree: Tree, base: str) -> Tree:
    """The tree with the text of every file that a table names, so that it can be read again without the file."""
    if isinstance(tree.value, list):
        return replace(tree, value=[embedded(child, base) for child in tree.value])
    if not isinstance(tree.value, dict):
        return tree
    values = {key: embedded(child, base) for key, child in tree.value.items()}
    table = values.get("table")
    if table is not None and isinstance(table.value, dict) and "file" in table.value:
        values["table"] = replace(table, value=_with_content(table.mapping(KEYS), base))
    return replace(tree, value=values)


def _with_content(fields: dict[str, Tree], base: str) -> dict[str, Tree]:
    if "csv" in fields:
        raise fields["csv"].error("the table has two roles: give `file` or `csv`.")
    file = fields.pop("file")
    name = file.text("the file of a table")
    path = document.beside(Path(base), name, file.place)
    if path is None:
        raise file.error(f"no file {name} beside the case.")
    return {"csv": Tree(document.read(path), Place(str(path))), **fields}


def is_csv(tree: Tree) -> bool:
    """Whether a history is a table given as text."""
    table = tree.value.get("table") if isinstance(tree.value, dict) else None
    return table is not None and isinstance(table.value, dict) and "csv" in table.value


def table(tree: Tree, unit: str) -> Table:
    """The history of a column; times are in the column ``t``, values in the one named, or after the variable."""
    fields = tree.value["table"].mapping(KEYS[1:])
    content = fields["csv"]
    rows = _rows(content)
    variable = tree.place.path.rpartition(".")[2]
    columns = [_column(cell, rows[0]) for cell in rows[0].cells]
    times = _index("t", columns, rows[0])
    values = _values(variable, fields.get("column"), columns, rows[0])
    for row in rows[1:]:
        if len(row.cells) != len(columns):
            raise row.error(f"{len(row.cells)} values for {len(columns)} columns.")
    moments = [_number(row, times, columns, "s") for row in rows[1:]]
    for row, (earlier, later) in zip(rows[2:], pairwise(moments), strict=False):
        if later < earlier:
            raise row.error("times must never decrease.")
    try:
        return Table(
            times=moments,
            values=[_number(row, values, columns, unit, variable) for row in rows[1:]],
            place=tree.place,
        )
    except InputError as error:
        raise error.at(content.place) from None


@dataclass(frozen=True)
class TableLine:
    """A line of the table, with its place."""

    cells: Sequence[str]
    line: int
    place: Place

    def error(self, message: str) -> InputError:
        """An input error at this line."""
        if self.place.line or self.place.path:  # the text stands in the case itself
            return InputError(f"line {self.line} of the table: {message}", self.place)
        return InputError(message, replace(self.place, line=self.line))


def _rows(content: Tree) -> list[TableLine]:
    """Lines that are neither empty nor comments; the first is the heading."""
    lines = enumerate(content.text("the table").splitlines(), start=1)
    kept = [(number, line) for number, line in lines if line.strip() and not line.lstrip().startswith("#")]
    rows = [
        TableLine([cell.strip() for cell in cells], number, content.place)
        for (number, _), cells in zip(kept, csv.reader(line for _, line in kept), strict=True)
    ]
    if not rows:
        raise content.error(f"the table is empty; its first line names the columns and their units: {EXAMPLE}.")
    return rows


def _column(cell: str, heading: TableLine) -> tuple[str, str]:
    """Name and unit of a column."""
    found = HEADING.fullmatch(cell)
    if found is None:
        number = heading.cells.index(cell) + 1
        raise heading.error(f"the heading of column {number} is no name with a unit; the first line is like {EXAMPLE}.")
    return found["name"], found["unit"].strip()


def _values(variable: str, named: Tree | None, columns: Sequence[tuple[str, str]], heading: TableLine) -> int:
    """The column that is named, else that of the variable; one of another name is never meant by itself."""
    if named is not None:
        return _index(named.text("column"), columns, heading)
    others = [name for name, _ in columns if name != "t"]
    if variable not in others and others:
        guess = suggestion(variable, [name for name, _ in columns])
        other = others[0] if len(others) == 1 else "NAME"
        raise heading.error(f"no column '{variable}'.{guess} To take one of another name, write `column: {other}`.")
    return _index(variable, columns, heading)


def _index(name: str, columns: Sequence[tuple[str, str]], heading: TableLine) -> int:
    names = [known for known, _ in columns]
    if names.count(name) > 1:
        raise heading.error(f"the column {name} is there {names.count(name)} times.")
    if name not in names:
        raise heading.error(f"no column '{name}'.{suggestion(name, names)}")
    return names.index(name)


def _number(row: TableLine, index: int, columns: Sequence[tuple[str, str]], unit: str, variable: str = "") -> float:
    name, given = columns[index]
    cell = row.cells[index]
    whose = f"{variable}, from the column {name}," if variable and variable != name else name
    try:
        float(cell)
    except ValueError:
        raise row.error(f"{whose} is no number there.") from None
    try:
        return parse(cell if given == "1" else f"{cell} {given}", unit, name=whose)
    except InputError as error:
        raise row.error(error.message) from None

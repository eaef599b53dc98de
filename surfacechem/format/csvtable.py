"""Histories from files: a table whose columns have names and units, read as strictly as a case."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from surfacechem.contracts.units import parse
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, suggestion
from surfacechem.laws.loading import Table

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
        fields = table.mapping(KEYS)
        if "csv" in fields:
            raise fields["csv"].error("the table has two roles: give `file` or `csv`.")
        file = fields.pop("file")
        name = file.text("the file of a table")
        path = document.beside(Path(base), name, file.place)
        if path is None:
            raise file.error(f"no file {name} beside the case.")
        values["table"] = replace(table, value={"csv": Tree(document.read(path), Place(str(path))), **fields})
    return replace(tree, value=values)


def is_csv(tree: Tree) -> bool:
    """Whether a history is a table given as text."""
    table = tree.value.get("table") if isinstance(tree.value, dict) else None
    return table is not None and isinstance(table.value, dict) and "csv" in table.value


def table(tree: Tree, unit: str) -> Table:
    """The history of a column; times are in the column ``t``, values in the one named, or after the variable."""
    fields = tree.value["table"].mapping(KEYS[1:])
    content = fields["csv"]
    heading, *rows = _rows(content)
    columns = _columns(heading)
    names, variable = [name for name, _ in columns], tree.place.path.rpartition(".")[2]
    times = _index("t", names, heading)
    values = _index(fields["column"].text("column") if "column" in fields else variable, names, heading)
    for row in rows:
        if len(row.cells) != len(columns):
            raise row.error(f"{len(row.cells)} values for {len(columns)} columns.")
    moments = [_number(row, times, columns, "s") for row in rows]
    for row, (earlier, later) in zip(rows[1:], pairwise(moments), strict=True):
        if later < earlier:
            raise row.error("times must never decrease.")
    try:
        read = [_number(row, values, columns, unit, variable) for row in rows]
        return Table(times=moments, values=read, place=tree.place)
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


def _columns(heading: TableLine) -> list[tuple[str, str]]:
    """Name and unit of each column."""
    columns = []
    for number, cell in enumerate(heading.cells, start=1):
        if (found := HEADING.fullmatch(cell)) is None:
            raise heading.error(
                f"the heading of column {number} is no name with a unit; the first line is like {EXAMPLE}."
            )
        columns.append((found["name"], found["unit"].strip()))
    return columns


def _index(name: str, names: Sequence[str], heading: TableLine) -> int:
    if names.count(name) > 1:
        raise heading.error(f"the column {name} is there {names.count(name)} times.")
    if name not in names:
        others = [other for other in names if other != "t"]
        other = others[0] if len(others) == 1 else "NAME"
        # A column of another name is never meant by itself.
        remedy = f" To take one of another name, write `column: {other}`." if others and name != "t" else ""
        raise heading.error(f"no column '{name}'.{suggestion(name, names)}{remedy}")
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

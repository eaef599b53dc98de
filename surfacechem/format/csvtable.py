"""Histories from files: tables whose columns have names and units, checked as strictly as a case."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from itertools import pairwise

from surfacechem.contracts.units import parse
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, placed, suggestion
from surfacechem.laws.loading import Table

KEY_MEANINGS = {
    "file": "a CSV file beside the case; its first line is like t [s], w_n [um]",
    "csv": "the text of such a file",
    "column": "the column of the values, if not named after the variable",
}
KEYS = tuple(KEY_MEANINGS)
COLUMN_HEADING = re.compile(r"(?P<name>[A-Za-z]\w*)(\s*\[(?P<unit>[^\]]+)\])?")
EXAMPLE = '"t [s], w_n [um]"'


def embedded(tree: Tree, base: str) -> Tree:
    """Insert the text of every table file into the tree, so that it can be read again without the file."""
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
        path = document.named(fields.pop("file"), base, "the file of a table")
        values["table"] = replace(table, value={"csv": Tree(document.read(path), Place(str(path))), **fields})
    return replace(tree, value=values)


def table(tree: Tree, unit: str) -> Table | None:
    """Return the history of a column: times from column ``t``, values from the named one, or from the variable's.

    None if the tree is no table in text form.
    """
    given = tree.value.get("table") if isinstance(tree.value, dict) else None
    if given is None or not isinstance(given.value, dict) or "csv" not in given.value:
        return None
    fields = given.mapping(KEYS[1:])
    content, variable = CSVText(fields["csv"], renamed=True), tree.place.path.rpartition(".")[2]
    name = fields["column"].text("column") if "column" in fields else variable
    times, values = content.column("t", "s", "t"), content.column(name, unit, variable)
    for (line, _), (earlier, later) in zip(content.rows[1:], pairwise(times), strict=True):
        if later < earlier:
            raise content.error(line, "times must never decrease.")
    with placed(content.place):
        return Table(times=times, values=values, place=tree.place)


class CSVText:
    """A table as text: a heading of names and units, and rows; empty lines and comments are skipped.

    A name without a unit belongs to a dimensionless quantity. Messages quote a heading only if the user has named the
    file (``quoted``), since a case may come from anywhere. With ``renamed`` they mention that another column may be
    chosen.
    """

    def __init__(self, content: Tree, quoted: bool = False, renamed: bool = False) -> None:
        self.place, self.renamed = content.place, renamed
        given = content.value if isinstance(content.value, str) else content.text("the table")
        lines = enumerate(given.splitlines(), start=1)
        kept = [(line, text) for line, text in lines if text.strip() and not text.lstrip().startswith("#")]
        cells = csv.reader(text for _, text in kept)
        rows = [(line, [cell.strip() for cell in row]) for (line, _), row in zip(kept, cells, strict=True)]
        if not rows:
            raise content.error(f"the table is empty; its first line names the columns and their units: {EXAMPLE}.")
        self.heading, *self.rows = rows
        self.columns = self._columns(quoted)
        for line, row in self.rows:
            if len(row) != len(self.columns):
                raise self.error(line, f"{len(row)} values for {len(self.columns)} columns.")

    def _columns(self, quoted: bool) -> list[tuple[str, str]]:
        """Return names and units of the columns; a unit may be empty."""
        line, cells = self.heading
        found = [COLUMN_HEADING.fullmatch(cell) for cell in cells]
        if None in found:
            column = found.index(None)
            which = f"'{cells[column]}'" if quoted else f"of column {column + 1}"
            raise self.error(line, f"the heading {which} is no name with a unit, like w_n [um] or phi [1].")
        return [(match["name"], (match["unit"] or "").strip()) for match in found if match]

    def error(self, line: int, message: str) -> InputError:
        """Return an input error at a line of the file, or of the text in the case itself."""
        if self.place.line or self.place.path:
            return InputError(f"line {line} of the table: {message}", self.place)
        return InputError(message, replace(self.place, line=line))

    def column(self, name: str, unit: str, variable: str) -> list[float]:
        """Return the numbers of a column, values of a variable, in SI."""
        index, found = self._index(name), []
        given = self.columns[index][1] or "1"
        if not self.columns[index][1] and unit != "1":
            raise self.error(self.heading[0], f"the heading '{name}' needs a unit: {name} [{unit}].")
        whose = name if name == variable else f"{variable}, from the column {name},"
        for line, row in self.rows:
            try:
                float(row[index])  # a unit after the number would be a second one
            except ValueError:
                raise self.error(line, f"{whose} is no number there.") from None
            try:
                found.append(parse(row[index] if given == "1" else f"{row[index]} {given}", unit, name=whose))
            except InputError as error:
                raise self.error(line, error.message) from None
        return found

    def _index(self, name: str) -> int:
        """Return the index of a column."""
        names = [known for known, _ in self.columns]
        if names.count(name) > 1:
            raise self.error(self.heading[0], f"the column {name} is there {names.count(name)} times.")
        if name not in names:
            others = [other for other in names if other != "t"]
            other = others[0] if len(others) == 1 else "NAME"
            # A column of another name is never chosen automatically.
            remedy = (
                f" To take one of another name, write `column: {other}`."
                if self.renamed and others and name != "t"
                else ""
            )
            raise self.error(self.heading[0], f"no column '{name}'.{suggestion(name, names)}{remedy}")
        return names.index(name)

"""Data files of a case: histories and heights in CSV files, whose columns have names and units; heights in netCDF."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

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


def with_files(tree: Tree, base: str) -> Tree:
    """Insert the text of every table file, and the numbers of every file of heights, into the tree, so that it can be
    read again without the files.
    """
    if isinstance(tree.value, list):
        return tree._replace(value=[with_files(child, base) for child in tree.value])
    if not isinstance(tree.value, dict):
        return tree
    values = {key: with_files(child, base) for key, child in tree.value.items()}
    for key, contents in (("table", _text), ("heights", _numbers)):
        if key in values and isinstance(values[key].value, dict) and "file" in values[key].value:
            values[key] = contents(values[key], base)
    return tree._replace(value=values)


def _text(tree: Tree, base: str) -> Tree:
    """Return a table with the text of its file."""
    fields = tree.mapping(KEYS)
    if "csv" in fields:
        raise fields["csv"].error("the table has two roles: give `file` or `csv`.")
    path = document.named(fields.pop("file"), base, "the file of a table")
    return tree._replace(value={"csv": Tree(document.read(path), Place(str(path))), **fields})


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
            apart = " Columns are separated by commas." if ";" in cells[column] or "\t" in cells[column] else ""
            raise self.error(line, f"the heading {which} is no name with a unit, like w_n [um] or phi [1].{apart}")
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
            others, remedy = [other for other in names if other != "t"], ""
            if self.renamed and others and name != "t":  # a column of another name is never chosen automatically
                remedy = f" To take one of another name, write `column: {others[0] if len(others) == 1 else 'NAME'}`."
            raise self.error(self.heading[0], f"no column '{name}'.{suggestion(name, names)}{remedy}")
        return names.index(name)


AXES = "xyz"
MISSING_HEIGHTS = ("", "nan", "na", "inf", "-inf")
"""Entries for missing heights in tables of instruments."""

NETCDF = ".nc"

Numbers = dict[str, list[float]]
"""Increasing coordinates x and y, and heights, along y for the first x, then for the next [m]."""


def _numbers(tree: Tree, base: str) -> Tree:
    """Return the parameters of a law of heights from their file; InputError, with file and place, for missing ones."""
    path = document.named(tree.mapping(("file",))["file"], base, "the file of heights")
    place = Place(str(path))
    numbers = from_netcdf(path) if path.suffix == NETCDF else from_csv(Tree(document.read(path), place))
    # Errors of the numbers, coordinates that do not increase for instance, are reported for the file.
    found = {axis: Tree([Tree(value, place) for value in values], place) for axis, values in numbers.items()}
    return tree._replace(value=found)


def from_csv(content: Tree) -> Numbers:
    """Read heights from a table with one row per place, in any order."""
    table = CSVText(content)
    for line, row in table.rows:
        if any(cell.lower() in MISSING_HEIGHTS for cell in row):
            raise table.error(line, "the heights have a hole: z is no finite number there.")
    x, y, z = (table.column(axis, "m", axis) for axis in AXES)
    heights: dict[tuple[float, float], float] = {}
    for (line, _), place, height in zip(table.rows, zip(x, y, strict=True), z, strict=True):
        if place in heights:
            raise table.error(line, f"a second height at x = {place[0]:g} m, y = {place[1]:g} m.")
        heights[place] = height
    # Equal coordinates are equal texts, so the grid needs no tolerance.
    along = sorted(set(x)), sorted(set(y))
    for place in product(*along):
        if place not in heights:
            hole = f"none is given at x = {place[0]:g} m, y = {place[1]:g} m"
            grid = f"on {len(along[0])} x {len(along[1])} places {hole}"
            raise InputError(f"the heights have holes: {grid}.", content.place)
    return {"x": along[0], "y": along[1], "z": [heights[place] for place in product(*along)]}


def from_netcdf(path: Path) -> Numbers:
    """Read heights from a variable z over the coordinates x and y, each with its unit."""
    import xarray

    place = Place(str(path))
    try:
        with xarray.open_dataset(path, engine="netcdf4") as file:
            data = file.load()
    except (OSError, ValueError) as error:
        raise InputError(f"no netCDF file: {error}.", place) from None
    if not {*AXES} <= {*data.variables} or {*data["z"].dims} != {"x", "y"}:
        raise InputError("heights are a variable z over the coordinates x and y.", place)
    metres = {axis: parse(f"1 {data[axis].attrs.get('units', '1')}", "m", place, axis) for axis in AXES}
    x, y, z = (data[axis].astype(float) * metre for axis, metre in metres.items())
    z = z.transpose("x", "y")
    holes = [(i, j) for i, j in product(range(len(x)), range(len(y))) if not math.isfinite(z.values[i, j])]
    if holes:
        where = f"x = {float(x[holes[0][0]]):g} m, y = {float(y[holes[0][1]]):g} m"
        raise InputError(f"the heights have holes: {len(holes)} of them, the first at {where}.", place)
    return {"x": x.values.tolist(), "y": y.values.tolist(), "z": z.values.ravel().tolist()}

"""Surface heights from files: a CSV file with columns x, y and z, or a netCDF file with z over x and y."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from pathlib import Path

from surfacechem.contracts.units import parse
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place
from surfacechem.format.csvtable import CSVText

AXES = "xyz"
MISSING_HEIGHTS = ("", "nan", "na", "inf", "-inf")
"""Entries for missing heights in tables of instruments."""

NETCDF = ".nc"

Numbers = dict[str, list[float]]
"""Increasing coordinates x and y, and heights, along y for the first x, then for the next [m]."""


def embedded(tree: Tree, base: str) -> Tree:
    """Insert the numbers of height files into a case; InputError, with file and place, for missing heights."""
    if not isinstance(tree.value, dict):
        return tree
    read = {key: (_numbers if key == "heights" else embedded)(child, base) for key, child in tree.value.items()}
    return replace(tree, value=read)


def _numbers(tree: Tree, base: str) -> Tree:
    """Return the parameters of a law of heights, from their file if one is named."""
    if not (isinstance(tree.value, dict) and "file" in tree.value):
        return tree
    path = document.named(tree.mapping(("file",))["file"], base, "the file of heights")
    place = Place(str(path))
    numbers = from_netcdf(path) if path.suffix == NETCDF else from_csv(Tree(document.read(path), place))
    # Errors of the numbers, coordinates that do not increase for instance, are reported for the file.
    found = {axis: Tree([Tree(value, place) for value in values], place) for axis, values in numbers.items()}
    return replace(tree, value=found)


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
            grid = (
                f"on {len(along[0])} x {len(along[1])} places none is given at x = {place[0]:g} m, y = {place[1]:g} m"
            )
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

"""Heights of a surface from files: the same from either kind, and holes told with file and place."""

import jsonschema
import numpy as np
import pytest
import xarray

from surfacechem.documents.document import parse
from surfacechem.errors import InputError
from surfacechem.format import height_files
from surfacechem.format.schema import schema
from surfacechem.laws import find
from surfacechem.surfaces.projection import Shape, Surface

X, Y = np.arange(7) * 10.0, np.arange(6) * 20.0
Z = np.cos(X / 30)[:, None] * np.cos(Y / 40)


def table(rows):
    return "x [nm], y [nm], z [um]\n" + "".join(f"{x}, {y}, {z}\n" for x, y, z in rows)


ROWS = [(x, y, repr(float(z))) for (x, y), z in zip([(x, y) for x in X for y in Y], Z.ravel(), strict=True)]


def netcdf(folder, z, unit="um"):
    data = xarray.Dataset({"z": (("y", "x"), z.T, {"units": unit})}, {"x": X * 1e-9, "y": Y * 1e-9})
    for axis in "xy":
        data[axis].attrs["units"] = "m"
    data.to_netcdf(folder / "scan.nc")


def given(folder, name):
    tree = height_files.embedded(
        parse(f"surface: {{bodies: {{flat: {{heights: {{file: {name}}}}}}}}}", "case.yaml"), folder
    )
    return tree.plain()["surface"]["bodies"]["flat"]["heights"]


def test_both_kinds_of_files_give_the_surface_that_was_measured(tmp_path):
    (tmp_path / "scan.csv").write_text(table(reversed(ROWS)))
    netcdf(tmp_path, Z)
    shape = {"$ref": "#/$defs/shape.heights", "$defs": schema()["$defs"]}
    assert jsonschema.Draft202012Validator(shape).is_valid({"file": "scan.csv"})
    csv, nc = (given(tmp_path, name) for name in ("scan.csv", "scan.nc"))
    for axis in "xyz":
        assert nc[axis] == pytest.approx(csv[axis], rel=1e-15)
    surface = Surface(find(Shape, "heights")(**csv))
    places = np.array([[20e-9, 40e-9], [60e-9, 100e-9]])
    assert surface.derivatives(places, 3)[0][:, 2] == pytest.approx((Z[[2, 6], [2, 5]] - Z.max()) * 1e-6, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "rows", "message"),
    [
        ("scan.csv", ROWS[:9] + ROWS[10:], r"scan.csv: the heights have holes: on 7 x 6 .* x = 1e-08 m, y = 6e-08 m"),
        ("scan.csv", [*ROWS[:3], (0.0, 60.0, "nan"), *ROWS[4:]], r"scan.csv:5: the heights have a hole"),
        ("scan.csv", [*ROWS, ROWS[0]], "scan.csv:44: a second height at x = 0 m, y = 0 m"),
        ("scan.nc", None, r"scan.nc: the heights have holes: 1 of them, the first at x = 3e-08 m, y = 4e-08 m"),
        ("scan.npy", ROWS, r"scan.npy: no text in UTF-8; cases are YAML files, tables CSV"),
        ("other names.csv", ROWS, r"names.csv:1: no column 'z'. Known: h, x, y\.$"),
        ("other.csv", ROWS, r"case.yaml:1: .*no file other.csv beside the case"),
    ],
)
def test_holes_are_told_with_their_place(tmp_path, name, rows, message):
    (tmp_path / "scan.csv").write_text(table(rows or ROWS))
    (tmp_path / "other names.csv").write_text("x [nm],y [nm],h [nm]\n0,0,1\n")
    np.save(tmp_path / "scan.npy", Z)
    holed = Z.copy()
    holed[3, 2] = np.nan
    netcdf(tmp_path, holed)
    with pytest.raises(InputError, match=message):
        given(tmp_path, name)

"""Histories and heights from files: strict, with units, kept in the dataset, and holes told with file and place."""

import jsonschema
import numpy as np
import pytest
import xarray

import surfacechem
from surfacechem import format as cases
from surfacechem.documents.document import parse
from surfacechem.errors import InputError
from surfacechem.format import data_files
from surfacechem.format.schema import schema
from surfacechem.laws import find
from surfacechem.surfaces.projection import Shape, Surface

pytestmark = pytest.mark.around

CASE = """
T_0: 300 K
bodies:
  lower: {temperature: T, C: 1 J/m^2/K}
  upper: {temperature: T, C: 1 J/m^2/K}
interface: {temperature: T}
loading: {Q_1: {table: {file: heat.csv}}}
initial: {T: 300 K}
run: {until: 3 s, outputs: 31}
"""


def load(folder, content, case=CASE, changes=()):
    (folder / "heat.csv").write_text(content)
    (folder / "case.yaml").write_text(case)
    return surfacechem.load(folder / "case.yaml", changes)


def test_columns_have_units(tmp_path):
    given = "# measured\nt [min], Q_1 [mW/m^2], other [K]\n0, 0, 1\n0.05, 6000, 2\n"
    table = load(tmp_path, given).case.scene.loading["Q_1"]
    assert table.times == [0.0, 3.0]
    assert table.values == [0.0, 6.0]


def test_a_column_of_another_name_is_chosen_by_name(tmp_path):
    by_name = load(tmp_path, "t [s], a [W/m^2], b [W/m^2]\n0,1,2\n3,1,2\n", changes=["loading.Q_1.table.column=b"])
    assert by_name.case.scene.loading["Q_1"].values == [2.0, 2.0]
    only = load(tmp_path, "power [W/m^2], t [s]\n5, 0\n5, 3\n", changes=["loading.Q_1.table.column=power"])
    assert only.case.scene.loading["Q_1"].values == [5.0, 5.0]
    with pytest.raises(InputError, match=r"case\.yaml:2: bodies\.lower\.C = -1 is outside"):
        only.run({"bodies.lower.C": -1})
    with pytest.raises(InputError, match=r"heat\.csv:2: 5 K is a temperature; Q_1, from the column a, needs a heat"):
        load(tmp_path, "t [s], a [K]\n0, 5\n3, 5\n", changes=["loading.Q_1.table.column=a"])


def test_it_is_the_table_written_into_the_case(tmp_path):
    from_file = load(tmp_path, "t [s], Q_1 [W/m^2]\n0, 0\n1, 6\n3, 0\n").run()
    written = CASE.replace("{file: heat.csv}", "{times: [0, 1, 3], values: [0, 6, 0]}")
    assert np.array_equal(from_file.dataset.T, surfacechem.load(written).run().dataset.T)


def test_the_text_is_kept(tmp_path):
    case = load(tmp_path, "t [s], Q_1 [W/m^2]\n0, 0\n1, 6\n").case
    (tmp_path / "heat.csv").unlink()
    again = cases.load_text(case.text)
    assert again.scene.loading["Q_1"].values == case.scene.loading["Q_1"].values
    assert again.text == case.text


@pytest.mark.parametrize("table", [{"file": "heat.csv"}, {"csv": "t [s]", "column": "Q_1"}])
def test_editors_know_both_ways(table):
    validator = jsonschema.Draft202012Validator(schema())
    document = parse(CASE).plain()
    document["loading"]["Q_1"]["table"] = table
    assert not list(validator.iter_errors(document))
    table["rows"] = 3
    assert list(validator.iter_errors(document))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("t [s], Q_1 [W/m^2]\n0, 0\n1, x\n", r"heat.csv:3: Q_1 is no number there"),
        ("t [s]; Q_1 [W/m^2]\n0; 0\n1; 1,5\n", r"heat.csv:1: the heading .* Columns are separated by commas"),
        ("t [s], Q_1 [K]\n0, 0\n1, 1\n", r"heat.csv:2: 0 K is a temperature; Q_1 needs"),
        ("t, Q_1 [W/m^2]\n0, 0\n1, 1\n", r"heat.csv:1: the heading 't' needs a unit: t \[s\]"),
        ("t s, Q_1 [W/m^2]\n0, 0\n1, 1\n", r"heat.csv:1: the heading of column 1 is no name with a unit, like"),
        ("t [s], Q_1 [W/m^2]\n0, 0\n1, 1, 1\n", r"heat.csv:3: 3 values for 2 columns"),
        ("t [s], Q_1 [W/m^2]\n\n2, 0\n1, 1\n", r"heat.csv:4: times must never decrease"),
        ("t [s], Q_1 [W/m^2]\n0, 0\n1e-300, 1\n", r"heat.csv: 1e-300 s between two .* for a jump give 1e-300 s twice"),
        ("t [s], Q_1 [W/m^2]\n1, 0\n1, 1\n1, 2\n", r"heat.csv: a table has no time three times, as 1 s; twice is"),
        (
            "t [s], Q_2 [W], x [W]\n0, 0, 0\n1, 1, 1\n",
            r"heat.csv:1: no column 'Q_1'. Did you mean 'Q_2'\? Known: Q_2, t",
        ),
        ("t [s], Q_2 [W/m^2]\n0, 0\n1, 1\n", r"heat.csv:1: no column 'Q_1'.*To take one.*`column: Q_2`\.$"),
        ("t [s], power [W/m^2]\n0, 0\n1, 1\n", r"heat.csv:1: no column 'Q_1'. Known: power, t. .*`column: power`"),
        ("t [s]\n0\n1\n", r"heat.csv:1: no column 'Q_1'"),
        ("t [s], Q_1 [W/m^2], Q_1 [W/m^2]\n0, 0, 0\n1, 1, 1\n", r"heat.csv:1: the column Q_1 is there 2 times"),
        ("t [s], Q_1 [W/m^2]\n0, 0\n", r"heat.csv: a table needs as many times \(1\)"),
        ("# nothing\n", r"heat.csv: the table is empty; its first line"),
        ("", r"heat.csv: the table is empty; its first line"),
        ("t [s], Q_1 [W/m^2]\n0, nan\n1, 1\n", r"heat.csv:2: .*nan"),
    ],
)
def test_bad_files_are_refused_by_line(tmp_path, content, message):
    with pytest.raises(InputError, match=message):
        load(tmp_path, content)


def test_a_table_in_the_case_has_its_lines():
    inline = CASE.replace("{file: heat.csv}", '{csv: "t [s], Q_1 [W/m^2]\\n0, 0\\n1, x"}')
    with pytest.raises(InputError, match=r"written.yaml:7: .*csv: line 3 of the table: Q_1 is no number"):
        cases.load_text(inline, "written")


def test_a_missing_file(tmp_path):
    (tmp_path / "heats.csv").touch()
    with pytest.raises(InputError, match=r"Q_1.table.file: no file heat.csv beside the case. Did you mean 'heats.csv'"):
        cases.load_text(CASE, base=tmp_path)
    with pytest.raises(InputError, match="two roles: give `file` or `csv`"):
        cases.load_text(CASE.replace("heat.csv", 'heat.csv, csv: "t [s]"'), base=tmp_path)


@pytest.mark.parametrize("name", ["{}/secret.csv", "../secret.csv", "link.csv"])
def test_what_lies_elsewhere_is_named_by_the_user_or_not_read(tmp_path, name):
    """A case may come from anywhere; it cannot make somebody's files appear in messages or datasets."""
    folder = tmp_path / "case"
    folder.mkdir()
    (tmp_path / "secret.csv").write_text("t [s], Q_1 [W/m^2]\n0, 0\n1, 1\n")
    (folder / "link.csv").symlink_to(tmp_path / "secret.csv")
    file = name.format(tmp_path)
    (folder / "written.yaml").write_text(CASE.replace("{file: heat.csv}", f"{{file: {file}}}"))
    with pytest.raises(InputError, match=r"written.yaml:7: .* lies outside the folder of the case.*--set loading.Q_1"):
        surfacechem.load(folder / "written.yaml")
    assert surfacechem.load(folder / "written.yaml", {"loading.Q_1.table.file": str(tmp_path / "secret.csv")})


def test_no_message_repeats_what_stands_in_a_file(tmp_path):
    (tmp_path / "heat.csv").write_text("daemon:x:0:0\nt [s], Q_1 [W/m^2]\n0, password\n")
    (tmp_path / "written.yaml").write_text(CASE)
    for _ in range(2):
        with pytest.raises(InputError) as caught:
            surfacechem.load(tmp_path / "written.yaml")
        assert "daemon" not in str(caught.value)
        assert "password" not in str(caught.value)
        (tmp_path / "heat.csv").write_text("t [s], Q_1 [W/m^2]\n0, password\n1, 1\n")


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
    tree = data_files.with_files(
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

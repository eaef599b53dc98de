"""The dataset: conventions, units, attributes, and files that appear whole or not at all."""

import errno
import os
import stat
from functools import lru_cache

import numpy as np
import pytest
import xarray
from case_runs import solved

import surfacechem
from surfacechem.errors import InputError, OutputError
from surfacechem.format import names
from surfacechem.results.netcdf import COORDINATES, Column, Data, cf_unit, replacing, save, write_netcdf

pytestmark = pytest.mark.around

SKIPPED = ["check_spatiotemporal_dims_have_coordinate_vars"]
"""Wants a calendar date of every coordinate called time; a run has elapsed seconds."""

LOOKUPS = (
    "get_auxiliary_coordinate_variables",
    "get_axis_variables",
    "get_climatology_variable",
    "get_geophysical_variables",
    "get_time_variable",
    "get_time_variables",
)
"""What the checker asks of a file again and again."""


@pytest.fixture(scope="module")
def solution():
    return solved("exothermic")


@pytest.fixture(scope="module")
def suite():
    """The checker of the conventions. For each variable it looks through all of them, several times; in a file that is
    only read it finds the same every time.
    """
    runner = pytest.importorskip("compliance_checker.runner")
    util = pytest.importorskip("compliance_checker.cf.util")
    suite = runner.CheckSuite()
    suite.load_all_available_checkers()
    with pytest.MonkeyPatch.context() as patch:
        for name in LOOKUPS:
            patch.setattr(util, name, lru_cache(maxsize=1)(getattr(util, name)))
        yield suite


def complaints(suite, file):
    """What breaks the conventions in a file."""
    results, problems = suite.run_all(suite.load_dataset(str(file)), ["cf:1.11"], skip_checks=SKIPPED)["cf:1.11"]
    assert problems == {}
    return [message for result in results for message in result.msgs]


def kinds(name):
    """What the conventions look at in the variables of a case, beside their units."""
    return {(column.dimensions, column.values.dtype.kind, bool(column.tag)) for column in solved(name).columns}


OF_EVERY_KIND = ("sticky-sphere", "sudden-contact", "lithium-polarisation")
"""Cases with variables of every kind; of several species the checker cannot read the names."""


@pytest.mark.parametrize("name", OF_EVERY_KIND)
def test_follows_the_cf_conventions(suite, tmp_path, name):
    assert complaints(suite, solved(name).write(tmp_path / "case.nc")) == []


def test_every_kind_of_variable_is_in_a_file_that_is_checked():
    assert set().union(*map(kinds, names())) == set().union(*map(kinds, OF_EVERY_KIND))


def test_what_the_scene_does_not_have_is_not_there():
    data = surfacechem.run("sliding-dry").dataset
    assert not [name for name in data.variables if name.startswith(("phi", "g_n", "J_c", "mu", "site", "event"))]


@pytest.mark.parametrize("name", OF_EVERY_KIND)
def test_a_dataset_is_as_the_public_constructor_makes_it(name):
    columns, attributes = solved(name).columns, solved(name).attributes
    along = [c.name for c in columns if c.dimensions == (c.name,)]
    every = {c.name: (c.dimensions, c.values, c.attributes) for c in columns if c.name not in along}
    public = xarray.Dataset(every, {c.name: (c.dimensions, c.values, c.attributes) for c in columns if c.name in along})
    found = Data.of_columns(columns, attributes).to_xarray()
    xarray.testing.assert_identical(found, public.assign_attrs(attributes))
    for mine, usual in ((found.variables, public.variables), (found.coords, public.coords)):
        assert list(mine) == list(usual)
    assert found.sizes == public.sizes
    for axis in public.indexes:
        assert found.indexes[axis].identical(public.indexes[axis])
        assert found.isel({axis: -1}).identical(public.isel({axis: -1}).assign_attrs(attributes))
    assert Data.of_columns(columns, {COORDINATES: columns[-1].name}).to_xarray().coords.keys() == {
        *along,
        columns[-1].name,
    }


def test_a_file_is_replaced_whole(solution, tmp_path):
    path = tmp_path / "out.nc"
    path.write_text("old")
    solution.write(path)
    assert [file.name for file in tmp_path.iterdir()] == ["out.nc"]
    assert xarray.open_dataset(path)["T"].size == solution.dataset.sizes["time"]


def full_disk(folder):
    """Writing of netCDF that finds no room in a folder."""

    def write(path, columns, attributes):
        if path.parent == folder:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write_netcdf(path, columns, attributes)

    return write


def test_what_has_no_room_is_kept_elsewhere(solution, tmp_path, monkeypatch):
    (tmp_path / "full").mkdir()
    (tmp_path / "other").mkdir()
    monkeypatch.setattr("surfacechem.results.netcdf.write_netcdf", full_disk(tmp_path / "full"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "other"))
    with pytest.raises(OutputError, match=r"out\.nc: cannot be written: No space left on device\. The results"):
        solution.write(tmp_path / "full" / "out.nc")
    assert list((tmp_path / "full").iterdir()) == []
    (kept,) = (tmp_path / "other").iterdir()
    assert xarray.open_dataset(kept)["T"].size == solution.dataset.sizes["time"]


def test_where_there_is_no_room_at_all_nothing_stays_behind(solution, tmp_path, monkeypatch):
    monkeypatch.setattr("surfacechem.results.netcdf.write_netcdf", full_disk(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(OutputError, match=f"device. In {tmp_path} it cannot be written: No space left on device.$"):
        solution.write(tmp_path / "out.nc")
    assert list(tmp_path.iterdir()) == []


def test_what_no_file_can_hold_is_not_for_want_of_room(tmp_path):
    twice = [Column("T", ("time",), np.zeros(3), "K", "temperature")] * 2
    with pytest.raises(OutputError, match=r"cannot be written: .*name in use.* it cannot be written: .*name in use"):
        save(tmp_path / "out.nc", twice, {})


def test_only_errors_of_writing_are_told_as_such(tmp_path):
    with pytest.raises(RuntimeError, match="of the figure"), replacing(tmp_path / "out.png"):
        raise RuntimeError("of the figure")
    assert list(tmp_path.iterdir()) == []
    twice = [Column("T", ("time",), np.zeros(3), "K", "temperature")] * 2
    with pytest.raises(OSError, match="name"):  # of which the library makes a RuntimeError
        write_netcdf(tmp_path / "out.nc", twice, {})


@pytest.mark.parametrize("umask", [0o022, 0o077])
def test_permissions_follow_the_umask_and_the_file_that_is_replaced(solution, tmp_path, umask):
    usual = os.umask(umask)
    try:
        solution.write(tmp_path / "new.nc")
        (tmp_path / "old.nc").touch()
        (tmp_path / "old.nc").chmod(0o664)
        solution.write(tmp_path / "old.nc")
    finally:
        os.umask(usual)
    assert stat.S_IMODE((tmp_path / "new.nc").stat().st_mode) == 0o666 & ~umask
    assert stat.S_IMODE((tmp_path / "old.nc").stat().st_mode) == 0o664


@pytest.mark.parametrize("target", ["", "missing/out.nc"])
def test_an_unwritable_target_is_refused(solution, tmp_path, target):
    with pytest.raises(InputError, match=r"is a directory|cannot be written"):
        solution.write(tmp_path / target)


def test_units_in_the_notation_of_the_conventions():
    assert cf_unit("1/(J s m^2)") == "J-1 s-1 m-2"
    assert cf_unit("Pa s") == "Pa s"


def test_a_link_is_followed_and_what_is_no_file_is_left_alone(solution, tmp_path):
    real = tmp_path / "real.nc"
    real.write_text("old")
    (tmp_path / "link.nc").symlink_to(real)
    solution.write(tmp_path / "link.nc")
    assert (tmp_path / "link.nc").is_symlink()
    assert xarray.open_dataset(real)["T"].size == solution.dataset.sizes["time"]
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is no regular file"):
        solution.write(tmp_path / "pipe")
    real.chmod(0o444)
    with pytest.raises(InputError, match="it is read-only"):
        solution.write(real)


def test_a_solution_says_itself_in_a_line(solution):
    assert repr(solution).startswith(
        "<Solution 'Exothermic bonding, kappa = 0.5': finished, reached the end at t = 2.5 s"
    )
    assert repr(solution.audit).startswith("<Audit: energy ")
    assert repr(solution.trajectory).startswith("<Trajectory of phi, T: ")
    assert max(len(repr(part)) for part in (solution.audit, solution.trajectory, solution.accuracy)) < 300

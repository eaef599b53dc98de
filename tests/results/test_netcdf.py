"""Whatever has happened to a dataset, it is drawn and run again, or refused in one line."""

import errno
import os
import subprocess
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from random import Random

import numpy as np
import pytest
import xarray

import surfacechem
from surfacechem import plots
from surfacechem.errors import InputError
from surfacechem.results import netcdf
from surfacechem.runs import rerun

pytestmark = pytest.mark.around

VALUES = (0, -1, 3.5, "", "nonsense", "[1]", "{}", "null", "radau", "1e-6", "finished", np.array([1.0, 2.0]), np.nan)
RECORDS = ('{"changes": 3}', '{"times": "x"}', '{"times": [0, 1], "max_steps": "a"}', '{"changes": {"a.b": 3}}')
PLANS = ('{"axes": 3}', '{"axes": [], "until": null}', '{"axes": [{"path": "a", "values": ["x"]}], "until": null}')
NAMES = ("x", "time2", "T", "phi", "status", "x_mode", "profile_1", "event_time")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A run with events, a sweep and a study."""
    folder = tmp_path_factory.mktemp("datasets")
    study = surfacechem.precision(["exothermic"], solvers=["radau"], tolerances=[1e-4], repeat=1)
    study.write(folder / "study.nc")
    return {
        "run": surfacechem.run("debonding").write(folder / "run.nc"),
        "sweep": surfacechem.load("catch-bond").sweep({"loading.f": ["10 pN", "20 pN"]}).write(folder / "sweep.nc"),
        "study": folder / "study.nc",
    }


def is_used_or_refused(path: Path, again: bool) -> None:
    with suppress(InputError):
        plots.figure(path)
    with suppress(InputError):
        record = rerun.read(path)
        if again:
            rerun.differences(record, rerun.run_again(record))


@pytest.mark.parametrize("which", ["run", "sweep", "study"])
def test_datasets_that_are_whole_are_drawn_and_read(files, which):
    plots.figure(files[which])
    assert rerun.read(files[which]).variables


def damaged(data: bytes, random: Random) -> bytes:
    """The bytes of a file with some of them flipped, zero or overwritten, or cut off."""
    result, place = bytearray(data), random.randrange(len(data))
    match random.choice(["flip", "flip", "cut", "zero", "write"]):
        case "flip":
            for _ in range(random.choice([1, 3, 30])):
                result[random.randrange(len(data))] ^= 1 << random.randrange(8)
        case "cut":
            del result[place:]
        case "zero":
            result[place : place + 64] = bytes(64)
        case _:
            result[place : place + 16] = bytes(random.randrange(32, 127) for _ in range(16))
    return bytes(result)


EACH = """
import resource, sys, time, warnings
from contextlib import suppress
from surfacechem.errors import InputError
from surfacechem import plots
from surfacechem.results import netcdf
from surfacechem.runs import rerun

warnings.simplefilter("ignore")
netcdf._try_elsewhere = lambda path, seconds: None  # this is that process
for name in sys.argv[1:]:
    print(name, flush=True)
    resource.setrlimit(resource.RLIMIT_CPU, (int(time.process_time()) + 6, resource.RLIM_INFINITY))
    for use in (lambda: plots.figure(name), lambda: rerun.read(name)):
        with suppress(InputError):
            use()
"""
"""Damaged files used one after the other, each with its name, until HDF5 does not come back from one."""


@pytest.mark.parametrize("count", [3, pytest.param(1000, marks=pytest.mark.slow)])
def test_damaged_bytes(files, count, tmp_path, monkeypatch):
    monkeypatch.setattr(netcdf, "READING_TIMEOUT", 5.0)
    random = Random(count)
    names = [str(tmp_path / f"{which}{i}.nc") for which in files for i in range(count)]
    for name, file in zip(names, np.repeat([*files.values()], count), strict=True):
        Path(name).write_bytes(damaged(file.read_bytes(), random))
    while names:
        done = subprocess.run([sys.executable, "-c", EACH, *names], capture_output=True, text=True, check=False)
        used = done.stdout.split()
        if done.returncode:
            assert done.returncode < 0, f"{used[-1:]}: {done.stderr}"
            with pytest.raises(InputError, match=r"no answer|crashes|not a readable"):
                rerun.read(used[-1])
        names = names[len(used) :]


LEAVING = """
import sys
from surfacechem.errors import InputError
from surfacechem.results import netcdf
from surfacechem.runs import rerun
endless, ends = ("while True: pass", 1.0), (("import os; os.abort()", 600.0), ("raise OSError", 600.0))
for netcdf.READING_TEST, netcdf.READING_TIMEOUT in (endless, *ends):  # on a machine of any load
    try:
        rerun.read(sys.argv[1])
    except InputError as error:
        print(error)
"""


def test_a_process_outlives_what_reading_a_file_does_not(tmp_path):
    (tmp_path / "x.nc").write_bytes(b"nothing that netCDF knows")
    command = [sys.executable, "-c", LEAVING, str(tmp_path / "x.nc")]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    for line, words in zip(lines, ("no answer in 1", "crashes", "NetCDF"), strict=True):
        assert words in line


def test_modules_in_the_folder_of_a_file_are_not_those_that_read_it(files, tmp_path, monkeypatch):
    (tmp_path / "re.py").write_text("raise SystemExit(3)")
    monkeypatch.chdir(tmp_path)
    assert "time" in rerun.read(files["run"]).variables


@pytest.mark.parametrize("departures", ['{"atol": NaN}', '{"times": [1, 0]}'])
def test_settings_that_no_run_has_are_refused_with_the_file(files, tmp_path: Path, departures: str) -> None:
    with xarray.open_dataset(files["run"]) as dataset:
        dataset.assign_attrs(departures=departures).to_netcdf(tmp_path / "run.nc")
    with pytest.raises(InputError, match=r"run\.nc: (output times|rtol|atol)"):
        rerun.run_again(rerun.read(tmp_path / "run.nc"))


def edited(dataset: xarray.Dataset, random: Random) -> xarray.Dataset:
    """A dataset in which something is missing, renamed, replaced or of another kind."""
    name = random.choice(list(dataset.variables))
    match random.choice(["attribute", "record", "missing", "drop", "rename", "values", "kind", "part", "unit"]):
        case "attribute":
            dataset.attrs[random.choice(list(dataset.attrs))] = random.choice(VALUES)
        case "record":
            dataset.attrs[random.choice(["departures", "sweep", "study"])] = random.choice([*RECORDS, *PLANS, *VALUES])
        case "missing":
            del dataset.attrs[random.choice(list(dataset.attrs))]
        case "drop":
            dataset = dataset.drop_vars(name)
        case "rename":
            dataset = dataset.rename({name: random.choice(NAMES)})
        case "values":
            filled = np.full(dataset[name].shape, random.choice([np.nan, np.inf, -1.0, 0.0, 1e308]))
            dataset[name] = dataset[name].copy(data=filled)
        case "kind":
            dataset[name] = dataset[name].astype(random.choice([str, int, bool, np.float32]))
        case "part":
            part = random.choice([slice(0, 0), slice(0, 1), 0])
            dataset = dataset.isel({random.choice(list(dataset.sizes)): part})
        case _:
            dataset[name].attrs[random.choice(["units", "long_name"])] = random.choice(VALUES)
    return dataset


@pytest.mark.parametrize("which", ["run", "sweep", "study"])
@pytest.mark.parametrize("count", [4, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.filterwarnings("ignore")
def test_edited_datasets(files, which, count, tmp_path, monkeypatch):
    monkeypatch.setattr(netcdf, "_try_elsewhere", lambda path, seconds: None)  # the files themselves are sound
    whole, random = xarray.open_dataset(files[which]).load(), Random(count)
    for i in range(count):
        dataset = whole.copy(deep=True)
        try:
            for _ in range(random.choice([1, 2, 3])):
                dataset = edited(dataset, random)
            dataset.to_netcdf(tmp_path / f"{i}.nc", engine="netcdf4")
        except Exception:  # not every edit can be written
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            is_used_or_refused(tmp_path / f"{i}.nc", again=which != "study" and i % 4 == 0)


def test_a_sweep_whose_parameter_is_text_is_refused(files, tmp_path):
    dataset = xarray.open_dataset(files["sweep"]).load()
    dataset.assign_coords(loading_f=dataset.loading_f.astype(str)).to_netcdf(tmp_path / "text.nc")
    with pytest.raises(InputError, match="loading_f does not hold numbers in double precision"):
        plots.figure(tmp_path / "text.nc")


def test_a_read_only_file_system_is_told_with_the_name_of_the_file(tmp_path, monkeypatch):
    def refused(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "open", refused)
    monkeypatch.setattr(Path, "unlink", refused)
    with (
        pytest.raises(InputError, match=r"T\.nc: cannot be written: Read-only file system\."),
        netcdf.replacing(tmp_path / "T.nc"),
    ):
        pass

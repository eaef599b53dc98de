"""What is built and installed is complete."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from email import message_from_string
from importlib.metadata import version
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import surfacechem

pytestmark = pytest.mark.around

ROOT = Path(__file__).parents[1]


def files(folder: str, suffix: str = "") -> set[str]:
    return {p.relative_to(ROOT).as_posix() for p in (ROOT / folder).rglob(f"*{suffix}") if p.is_file()}


@pytest.fixture(scope="module")
def dist(tmp_path_factory):
    """A source distribution and the wheel built from it."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture(scope="module")
def wheel(dist):
    (path,) = dist.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        yield archive


def test_wheel_holds_the_package_its_cases_and_its_mechanisms(wheel):
    data = {f"surfacechem/_data/{name}" for name in files("cases") | files("mechanisms")}
    inside = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert inside >= files("surfacechem", ".py") | data
    assert {name.split("/")[0] for name in inside} == {"surfacechem"}


def test_the_wheel_runs_by_itself(dist, tmp_path):
    """From a folder of its own, without the checkout."""
    (path,) = dist.glob("*.whl")
    shutil.unpack_archive(path, tmp_path, "zip")  # which is what installing does where nothing is compiled
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    code = "import surfacechem; print(surfacechem.__file__, surfacechem.run('exothermic').accuracy.error)"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    place, error = done.stdout.split()
    assert Path(place).is_relative_to(tmp_path)
    assert float(error) < 1e-8


@pytest.mark.slow
def test_a_wheel_for_a_platform_compiles_nothing_and_computes_the_same(tmp_path):
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(ROOT)]
    subprocess.run(command, env={**os.environ, "SURFACECHEM_COMPILE": "1"}, capture_output=True, check=True)
    (path,) = tmp_path.glob("*.whl")
    assert not path.name.endswith("none-any.whl")
    shutil.unpack_archive(path, tmp_path / "unpacked", "zip")
    environment = {"PYTHONPATH": str(tmp_path / "unpacked"), "SURFACECHEM_CACHE": str(tmp_path / "cache")}
    environment = os.environ | environment
    code = """
import surfacechem
from surfacechem.solve.radau.stepper import LOOP
assert LOOP.is_compiled
print(surfacechem.run("dna-adhesive").trajectory.result.outputs.tobytes().hex())
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == surfacechem.run("dna-adhesive").trajectory.result.outputs.tobytes().hex()


def test_wheel_has_the_command_and_the_license(wheel):
    info = {name.split(".dist-info/")[1]: name for name in wheel.namelist() if ".dist-info/" in name}
    assert "surfacechem = surfacechem.cli:console" in wheel.read(info["entry_points.txt"]).decode()
    assert "licenses/LICENSE" in info
    assert message_from_string(wheel.read(info["METADATA"]).decode())["Requires-Python"] == ">=3.11"


def test_sdist_holds_what_a_rebuild_and_the_tests_need(dist):
    (path,) = dist.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        inside = {name.split("/", 1)[1] for name in archive.getnames()}
    assert inside >= files("surfacechem", ".py") | files("cases") | files("mechanisms") | files("tests", ".py")


def test_citation_has_the_version():
    assert YAML(typ="safe").load(ROOT / "CITATION.cff")["version"] == version("surfacechem")


def test_a_shell_completes_what_is_imported_when_it_is_asked_for():
    assert {*surfacechem.__all__, "__version__"} == set(dir(surfacechem))
    assert surfacechem.__version__ == version("surfacechem")

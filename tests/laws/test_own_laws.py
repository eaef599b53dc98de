"""Laws of one's own: by a file that a case names, by registration, by an entry point; never by opening a dataset."""

import hashlib
import math
import sys

import pytest
from typer.testing import CliRunner

import surfacechem
from surfacechem import laws
from surfacechem.cli.main import app
from surfacechem.contracts.terms import Friction
from surfacechem.errors import InputError
from surfacechem.format import cases
from surfacechem.results.netcdf import reading
from surfacechem.runs import rerun
from surfacechem.runs.check import problems

LAW = '''
from surfacechem.contracts.terms import Friction, parameter


class Slime(Friction):
    r"""Friction of slime.

    .. math:: t_t = \\eta v

    Source: none. Any v.

    >>> Slime(eta=2.0).traction(v=3.0)
    6.0
    """

    eta: float = parameter("Pa s/m", "resistance", at_least=0)
    ranges = {"v": (0.0, 1e-3)}

    def traction(self, v):
        return self.eta * v
'''
CASE = """
title: Two bodies in slime
laws: [slime.py]
T_0: 300 K
bodies:
  lower: {temperature: T, C: 2 kJ/m^2/K}
  upper: {temperature: T, C: 2 kJ/m^2/K}
interface:
  temperature: T
  friction:
    - slime: {eta: 20 MPa s/m}
loading: {v: 10 mm/s}
initial: {T: 300 K}
run: {until: 100 s, outputs: 3}
"""
T_END = 300 * math.sqrt(1 + 2 * 2e7 * 0.01**2 * 100 / (4000 * 300))
"""Bodies with U = C (T^2 - T_0^2) / (2 T_0) under a constant dissipation."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "slime.py").write_text(LAW)
    (tmp_path / "slime.yaml").write_text(CASE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cases, "_run", {})
    return tmp_path


def test_a_case_names_the_file_of_a_law(folder):
    solution = surfacechem.run("slime.yaml")
    assert float(solution.dataset["T"][-1]) == pytest.approx(T_END, rel=1e-9)
    assert solution.warnings[0].startswith("slime is an extrapolation: v ran from 0.01 to 0.01")
    assert "slime" not in laws.laws(Friction)  # no other case knows it


def test_a_dataset_keeps_the_source_and_runs_it_only_where_that_is_allowed(folder, monkeypatch):
    path = surfacechem.run("slime.yaml").write("slime.nc")
    (folder / "slime.py").unlink()
    record = rerun.read(path)
    monkeypatch.setattr(cases, "_run", {})
    with pytest.raises(InputError, match=r"carries code of its own, slime.py, which runs only where you allow it"):
        rerun.run_again(record)
    assert cases._run == {}
    assert rerun.differences(record, rerun.run_again(record, allow_code=True)) == []
    assert reading(path, lambda: True)


def test_a_checksum_tells_which_file_is_meant(folder):
    checksum = hashlib.sha256(LAW.encode()).hexdigest()
    text = CASE.replace("[slime.py]", f"[{{file: slime.py, sha256: {checksum}}}]")
    assert surfacechem.load(text).run().status == "finished"
    (folder / "slime.py").write_text(LAW + "# changed")
    with pytest.raises(InputError, match=r"slime.py is another file than the one meant: its checksum is"):
        surfacechem.load(text)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("x = 1 / 0\n", "slime.py:1: ZeroDivisionError: division by zero"),
        ("\nx = (\n", r"slime.py:2: SyntaxError: '\(' was never closed"),
        ("\nraise SystemExit(0)\n", r"slime.py:2: the file ends the process \(SystemExit\)"),
        ("import surfacechem\nsurfacechem.load('no-case')\n", "^slime.py:2: no file and no case 'no-case'"),
        ("x = 1\n", "slime.py defines no law: a law is a subclass of Friction"),
        (LAW.replace("Slime", "Coulomb"), "Coulomb has the name of the friction law 'coulomb' of the package"),
    ],
)
def test_a_file_that_gives_no_law_is_refused(folder, source, message):
    (folder / "slime.py").write_text(source)
    with pytest.raises(InputError, match=message):
        surfacechem.load("slime.yaml")


def test_a_law_is_registered(folder, monkeypatch):
    (law,) = cases.read_laws(LAW, "slime.py")
    text = CASE.replace("laws: [slime.py]", "")
    monkeypatch.setattr(laws, "_registered", {})
    with pytest.raises(InputError, match="no friction law 'slime'"):
        surfacechem.load(text)
    assert surfacechem.register(law) is law
    assert surfacechem.load(text).case.scene.interface.frictions[0].eta == 2e7
    for other in (int, type("Unstated", (Friction,), {})):
        with pytest.raises(InputError, match=f"{other.__name__} is no law"):
            surfacechem.register(other)


@pytest.fixture
def package(folder, monkeypatch):
    """An installed package as pip leaves it: a module, and what its metadata say of it."""
    site = folder / "site-packages"
    (metadata := site / "slimes-1.0.dist-info").mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: slimes\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[surfacechem.laws]\nslimes = slimes\n")
    (site / "slimes.py").write_text(LAW)
    (folder / "slime.yaml").write_text(CASE.replace("laws: [slime.py]", ""))
    monkeypatch.syspath_prepend(site)
    monkeypatch.delitem(sys.modules, "slimes", raising=False)
    laws._of_installed_packages.cache_clear()
    yield site / "slimes.py"
    laws._of_installed_packages.cache_clear()
    sys.modules.pop("slimes", None)


def test_an_installed_package_gives_its_laws(folder, package):
    call = CliRunner().invoke
    assert "Friction of slime." in call(app, ["laws", "slime"]).stdout
    assert call(app, ["run", "slime.yaml", "-o", "slime.nc"]).exit_code == 0
    assert call(app, ["rerun", "slime.nc"]).exit_code == 0
    assert float(surfacechem.run("slime.yaml").dataset["T"][-1]) == pytest.approx(T_END, rel=1e-9)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("import no_such_module", "slimes of an installed package gives no laws: ModuleNotFoundError: No module named"),
        (LAW.replace("Slime", "Coulomb"), "Coulomb has the name of the friction law 'coulomb' of the package"),
    ],
)
def test_a_package_that_gives_none_is_named(folder, package, source, message):
    package.write_text(source)
    with pytest.raises(InputError, match=message):
        surfacechem.load("slime.yaml")
    assert surfacechem.load("exothermic").case.name == "exothermic"  # which needs no law of it


@pytest.mark.parametrize(("checksum", "code"), [(hashlib.sha256(LAW.encode()).hexdigest(), 0), ("12ab", 2)])
def test_the_command_line_runs_the_file_that_is_meant_alone(folder, checksum, code):
    (folder / "slime.yaml").write_text(CASE.replace("[slime.py]", f"[{{file: slime.py, sha256: {checksum}}}]"))
    assert CliRunner().invoke(app, ["run", "slime.yaml", "-o", "slime.nc"]).exit_code == code
    assert (folder / "slime.nc").exists() is (code == 0)


def test_what_every_law_keeps_is_tried_on_one_of_ones_own(folder):
    call = CliRunner().invoke
    done = call(app, ["laws", "--from", "slime.py", "--check"])
    assert (done.exit_code, done.stdout) == (0, "slime (friction): keeps what a law has to keep\n")
    (folder / "slime.py").write_text(LAW.replace("6.0", "7.0"))
    done = call(app, ["laws", "--from", "slime.py", "--check"])
    assert done.exit_code == 1
    assert "its worked number is another: Expected: 7.0 Got: 6.0" in done.stdout
    assert "Friction of slime." in call(app, ["laws", "slime", "--from", "slime.py"]).stdout


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("self.eta * v", "-self.eta * v", "it drives sliding at v = 0.7"),
        ("self.eta * v", "float(v)", "its formula fails: "),
        ("self.eta * v", "self.eta / 0 * v", "its formula fails: ZeroDivisionError"),
        ("def traction(self, v)", "def traction(self, w)", "it reads 'w', which no scene has"),
        ("Pa s/m", "Pa s/parsnip", "eta: no unit 'parsnip'"),
        ("Source: none.", "", "no source: write"),
    ],
)
def test_a_law_that_is_wrong_is_told_how(old, new, message):
    source = LAW.replace(old, new).replace(">>> Slime(eta=2.0).traction(v=3.0)\n    6.0", ">>> 1\n    1")
    (law,) = cases.read_laws(source, "slime.py")
    assert message in " ".join(problems(law))


TABLES = ("heights", "pair-table")
"""Laws that are nothing without a table."""


@pytest.mark.parametrize("contract", laws.FAMILIES, ids=lambda contract: contract.contract)
def test_the_laws_of_the_package_keep_what_one_of_ones_own_has_to(contract):
    found = {name: problems(law) for name, law in laws.laws(contract).items() if name not in TABLES}
    assert found == {name: [] for name in found}

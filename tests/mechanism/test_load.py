"""A mechanism that is kept in the cache folder is the one that Cantera reads, and is used only where it still is."""

import subprocess
import sys
from pathlib import Path

import pytest

import surfacechem
from mechanisms import SHIPPED
from surfacechem.documents import mechanisms
from surfacechem.errors import InputError
from surfacechem.laws import _registered, register
from surfacechem.laws.kinetics import Bell, RateType
from surfacechem.mechanism import load, load_mechanism, rates
from surfacechem.solve.radau.stepper import LOOP

PAIR = """
phases:
- {name: pair, thermo: ideal-surface, kinetics: surface, species: all, reactions: all, site-density: 1e-9 mol/m^2}
species:
- {name: free, composition: {}, thermo: {model: constant-cp}}
- {name: bond, composition: {}, thermo: {model: constant-cp}}
reactions:
- {equation: bond => free, rate-constant: {A: 3 1/s, b: 0, Ea: 0}}
"""
BESIDE = PAIR.replace("reactions: all,", "reactions: all, adjacent-phases: [{air.yaml/phases: [air]}],")
AIR = """
phases: [{name: air, thermo: ideal-gas, species: [N2]}]
species: [{name: N2, composition: {N: 2}, thermo: {model: constant-cp, T-max: 400 K}}]
"""
CASE = "dna-adhesive"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    LOOP.load()  # from the usual folder
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "mechanisms"


@pytest.fixture
def asked(monkeypatch):
    """The phases for which Cantera was asked."""
    phases, cantera = [], load._cantera

    def counted(source, phase):
        phases.append(phase["name"])
        return cantera(source, phase)

    monkeypatch.setattr(load, "_cantera", counted)
    return phases


def pair(text=PAIR, **options):
    return load_mechanism(Path("pair.yaml"), text=text, **options)


@pytest.mark.parametrize("name", SHIPPED)
def test_what_is_kept_is_what_was_read(name, asked):
    read, kept = (load_mechanism(mechanisms() / name) for _ in range(2))
    assert len(asked) == 1
    assert repr(read) == repr(kept)
    assert [(type(law), law.place) for law in read.reactions] == [(type(law), law.place) for law in kept.reactions]


def test_a_kept_case_has_the_same_bytes_and_needs_no_cantera(asked):
    read, kept = (surfacechem.load(CASE).run().dataset.load() for _ in range(2))
    assert len(asked) == 1
    for name in read.variables:
        one, other = read[name].values, kept[name].values
        assert one.dtype == other.dtype
        assert one.tolist() == other.tolist() if one.dtype == object else one.tobytes() == other.tobytes()
    code = f"import sys, surfacechem; surfacechem.load('{CASE}').model; print('cantera' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"


def test_another_text_phase_library_or_code_is_read_again(asked, monkeypatch):
    def rate():
        return pair().reactions[0].A

    assert (rate(), pair(PAIR.replace("A: 3", "A: 4")).reactions[0].A, rate(), len(asked)) == (3, 4, 3, 2)
    assert pair(bonds=["bond"]).bonds == ("theta_bond",)
    assert pair(name="other.yaml").reactions[0].place.file == "other.yaml"
    assert len(asked) == 4
    for name in ("version", "source_digest"):
        with monkeypatch.context() as patch:
            patch.setattr(load, name, lambda _: "another")
            rate()
            rate()
    assert len(asked) == 6
    assert (rate(), len(asked)) == (3, 6)


def test_a_rate_type_that_cantera_does_not_know_is_told_the_nearest():
    text = PAIR.replace("equation: bond", "type: Bel, equation: bond")
    with pytest.raises(InputError, match=r"m.yaml:8: Cantera: no rate type 'Bel'\. Did you mean 'Bell'"):
        load_mechanism(Path(), name="m.yaml", text=text, evaluate=True)


def test_a_mechanism_of_several_files_is_read_from_them_each_time(tmp_path, monkeypatch, folder):
    monkeypatch.chdir(tmp_path)
    Path("air.yaml").write_text(AIR)
    assert pair(BESIDE, evaluate=True).engine is None
    assert not folder.exists()
    Path("air.yaml").write_text(AIR.replace("species: [N2]", "species: [O2]"))
    with pytest.raises(InputError, match="O2"):
        pair(BESIDE, evaluate=True)


def test_an_extension_is_asked_each_time(tmp_path, monkeypatch, folder):
    (tmp_path / "another_rate.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    assert pair(PAIR + "extensions: [{type: python, name: another_rate}]\n").reactions
    assert not folder.exists()


def test_a_rate_type_of_ones_own_is_not_kept(folder):
    class Steep(Bell):
        """Another law of bonds."""

        rate_types = (RateType("steep", "log_off", {"k_off": 1.0}, renamed={"x_beta": "x_off"}),)

    register(Steep)
    rates.kinds.cache_clear()
    try:
        text = PAIR.replace("bond => free,", "bond => free, type: steep, x-beta: 1 nm,")
        assert pair(text).reactions[0].law is Steep
    finally:
        del _registered[Steep.name()]
        rates.kinds.cache_clear()
    assert not folder.exists()


@pytest.mark.parametrize(
    "harm", [lambda path: path.write_bytes(path.read_bytes()[:-1]), lambda path: path.chmod(0o666)]
)
def test_a_file_that_is_damaged_or_not_ours_is_read_again(folder, harm, asked):
    first = pair()
    (path,) = folder.iterdir()
    harm(path)
    assert repr(pair()) == repr(first) == repr(pair())
    assert len(asked) == 2


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(tmp_path, monkeypatch, asked):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path / "file"))
    assert repr(pair()) == repr(pair())
    assert len(asked) == 2


def test_a_wrong_mechanism_is_as_wrong_the_second_time(folder):
    said = []
    for _ in range(2):
        with pytest.raises(InputError) as error:
            pair(PAIR.replace("bond => free", "bond => fre"))
        said.append(str(error.value))
    assert said[0] == said[1]
    assert said[0].startswith("pair.yaml:8: ")
    assert not folder.exists()


def test_a_case_may_change_parameters_of_what_is_kept():
    change = "interface.mechanism.reactions.R1.A=1e9"
    first, second = (surfacechem.load(CASE, [change]).case.scene.interface.reactions[0].A for _ in range(2))
    assert first == second != surfacechem.load(CASE).case.scene.interface.reactions[0].A

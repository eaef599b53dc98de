"""Numbers of a mechanism as run-time parameters: changed, swept and checked as if the file had them."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from sampling import every

import surfacechem
from surfacechem.documents import cases, mechanisms
from surfacechem.errors import InputError
from surfacechem.runs import rerun

SPECIES = "interface.mechanism.species"
STIFFNESS, ENTROPY, CAPACITY = (f"{SPECIES}.bond(s).{name}" for name in ("stiffness", "s0", "cp0"))
RATE, ORDER = (f"interface.mechanism.reactions.R1.{name}" for name in ("A", "b"))

NASA7 = "{model: NASA7, temperature-ranges: [200, 290, 1000], data: [[1, 0, 0, 0, 0, 1, 1], [2, 0, 0, 0, 0, 3, 4]]}"


def case(folder, *replaced):
    """A shipped case whose mechanism has other text in some places."""
    text = (mechanisms() / "selectin-pulled.yaml").read_text(encoding="utf-8")
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    (folder / "selectin-pulled.yaml").write_text(text, encoding="utf-8")
    return shutil.copy(cases() / "press-hold-pull.yaml", folder)


def check(solution, expected):
    """Coverages and gap of two runs are the same at all times."""
    for name in ("theta_free_s", "theta_bond_s", "g_n"):
        np.testing.assert_allclose(solution.dataset[name], expected.dataset[name], rtol=1e-8, atol=1e-15)


EDITS = {
    STIFFNESS: ("6 pN/nm", ("stiffness: 5.3 pN/nm", "stiffness: 6 pN/nm")),
    RATE: ("0.03 1/s", ("A: 0.02 1/s", "A: 0.03 1/s")),
    ORDER: (0.1, ("b: 0, Ea: 0", "b: 0.1, Ea: 0")),
    ENTROPY: ("21 J/mol/K", ("s0: 19.14475 J/mol/K", "s0: 21 J/mol/K")),
}


@pytest.mark.parametrize("path", every(2, EDITS), ids=lambda path: path.rpartition(".")[2])
def test_a_number_that_is_changed_is_that_of_the_file(tmp_path, path):
    value, edit = EDITS[path]
    changed = surfacechem.load(case(tmp_path, edit))
    even = replace(changed.case.run, picture=None)
    expected = changed.run(run=even, error="balances")
    check(surfacechem.load("press-hold-pull", {path: value}).run(run=even, error="balances"), expected)
    check(surfacechem.load("press-hold-pull").run({path: value}, even, error="balances"), expected)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (STIFFNESS, "-1 N/m", r"stiffness = -1 is outside its range: >= 0"),
        (STIFFNESS, "1 m", r"1 m is a length; stiffness needs a"),
        ("interface.mechanism.reactions.R2.A", 1, r"unknown key 'R2'. Known: R1"),
        ("interface.mechanism.reactions.R1.x-beta", "1 nm", r"Did you mean 'x_beta'\?"),
        (f"{SPECIES}.free(s).stiffness", "1 N/m", r"unknown key 'stiffness'. Known: T0, cp0, h0, s0"),
        (f"{SPECIES}.bond.s0", 1, r"unknown key 'bond'. Did you mean 'bond\(s\)'"),
    ],
)
def test_what_is_wrong_is_told_with_its_path(path, value, message):
    with pytest.raises(InputError, match=message) as refused:
        surfacechem.load("press-hold-pull", {path: value})
    assert refused.value.place.path.startswith("interface.mechanism.")


def test_coefficients_of_polynomials_are_parameters_by_range(tmp_path):
    old = "thermo: {model: constant-cp, T0: 298.15 K, h0: 0 kJ/mol, s0: 19.14475 J/mol/K, cp0: 0 J/mol/K}"
    simulation = surfacechem.load(case(tmp_path, (old, f"thermo: {NASA7}")), "run.outputs=61")
    path = f"{SPECIES}.bond(s).range_2.a5"
    assert path not in {p.path for p in simulation.system.parameters}
    text = f"thermo: {NASA7.replace('3, 4]', '99, 4]')}"
    changed = surfacechem.load(case(tmp_path, (old, text)), "run.outputs=61")
    check(simulation.run({path: 99.0}, error="balances"), changed.run(error="balances"))


def test_thermo_that_cantera_uses_too_does_not_change(tmp_path):
    evaluated = "rate-constant: {A: 0.02 1/s, b: 0, Ea: 0}\n  x-beta: 0.25 nm"
    masel = "rate-constant: {A: 0.02 1/s, b: 0, Ea0: 10 kJ/mol, w: 100 kJ/mol}"
    edits = (evaluated, masel), ("type: Bell", "type: Blowers-Masel"), ("<=>", "=>")
    path = case(tmp_path, *edits)
    assert ENTROPY not in {p.path for p in surfacechem.load(path, {"run.solver": "cantera"}).system.parameters}
    with pytest.raises(InputError, match="Change it in the file"):
        surfacechem.load(path, {"run.solver": "cantera", ENTROPY: "1 J/mol/K"})


def test_a_saved_run_with_a_changed_number_is_run_again(tmp_path):
    simulation = surfacechem.load("press-hold-pull", {STIFFNESS: "6 pN/nm", "run.until": "2 s"})
    record = rerun.read(simulation.run({RATE: 0.03, ORDER: 0.1}).write(tmp_path / "changed.nc"))
    assert rerun.differences(record, rerun.run_again(record)) == []

"""What is compiled or loaded during a run is no run time."""

from types import SimpleNamespace

import pytest

import surfacechem
from surfacechem.compile import PREPARATION, program
from surfacechem.format.cases import load_text
from surfacechem.solve.run import Model


def test_a_block_within_another_counts_once(monkeypatch):
    clock = iter([10.0, 17.0])
    monkeypatch.setattr("surfacechem.compile.time", SimpleNamespace(perf_counter=lambda: next(clock)))
    before = PREPARATION.seconds
    with PREPARATION:
        with PREPARATION:
            pass
        PREPARATION(lambda: None)()
    assert PREPARATION.seconds - before == 7.0


RESTING = """
T_0: 300 K
bodies: {lower: {temperature: T, C: 1 J/m^2/K, stiffness: 2e12 Pa/m}, upper: {temperature: T, C: 1 J/m^2/K}}
interface: {temperature: T, potential: [normal-stiffness: {E_n: 1e12 Pa/m}]}
loading: {w_n: {ramp: {rate: -10 nm/s}}}
initial: {T: 300 K}
run: {until: 1 s}
"""


@pytest.mark.parametrize("name", ["bouncing-plate", "at rest"])
def test_the_code_of_jumps_and_of_gaps_at_rest_is_compiled_once_and_counts_as_compiled(name, monkeypatch):
    program._machine_code.cache_clear()
    case = load_text(RESTING) if name == "at rest" else surfacechem.load(name).case
    model = Model(case.system())
    spent = model.compile_seconds
    first = model.solve(case.run)
    assert bool(first.jumps) == (name != "at rest")
    assert len(first.outputs)  # compiles the rates, which outputs need
    assert model.compile_seconds > spent
    monkeypatch.setattr("surfacechem.compile.program.symengine.Lambdify", None)  # nothing is compiled again
    if name == "at rest":
        softer = model.solve(case.run, {"interface.potential.normal-stiffness.E_n": 1e11})
        # The overlap k w / (k + E_n).
        assert softer.everywhere("g_n")[-1] == pytest.approx(-1e-8 * 2e12 / 2.1e12, rel=1e-9)
    else:
        assert len(model.solve(case.run).jumps) == len(first.jumps)

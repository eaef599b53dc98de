"""What is compiled or loaded during a run is no run time."""

from types import SimpleNamespace

import surfacechem
from surfacechem.compile import preparing
from surfacechem.compile.preparing import PREPARING


def test_a_block_within_another_counts_once(monkeypatch):
    clock = iter([10.0, 17.0])
    monkeypatch.setattr(preparing, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    before = PREPARING.seconds
    with PREPARING:
        with PREPARING:
            pass
        PREPARING(lambda: None)()
    assert PREPARING.seconds - before == 7.0


def test_the_code_of_jumps_counts_as_compiled_and_not_as_run(monkeypatch):
    model = surfacechem.load("debonding").model
    run = surfacechem.load("debonding").case.run
    spent = model.compile_seconds
    first = model.solve(run)
    assert first.jumps
    assert model.compile_seconds > spent
    monkeypatch.setattr("surfacechem.compile.program.symengine.Lambdify", None)  # nothing is compiled again
    assert model.solve(run).jumps

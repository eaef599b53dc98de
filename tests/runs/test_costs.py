"""What a run costs beside the compiled loop, counted in calls: times depend on the machine, calls do not."""

import sys
from collections.abc import Callable

import surfacechem


def calls_of(function: Callable[[], object]) -> int:
    """Calls of Python and of C that a function makes."""
    count = 0

    def profiled(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(profiled)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count


def test_a_run_with_its_error_and_its_audit_takes_few_calls():
    case = surfacechem.load("exothermic")
    _ = case.run().audit  # what is made once a model
    runs = []
    assert calls_of(lambda: runs.append(case.run({"interface.potential.bond-energy.K_0": 301.0}))) < 600
    assert calls_of(lambda: runs[0].audit) < 240
    assert runs[0].accuracy.source == "exact solution exothermic-bonding"


def test_a_second_run_takes_few_calls():
    case = surfacechem.load("catch-bond")
    _ = case.run().audit
    assert calls_of(case.run) < 350

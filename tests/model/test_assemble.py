"""Components are found by their files, and each states something in a phase."""

from importlib import import_module

import numpy as np
import scenes
import symengine

from surfacechem.model import assemble


def test_every_component_that_has_a_place_states_something_in_a_phase():
    places, phases = assemble._places(), {phase for group in assemble.PHASES for phase in group}
    assert {*assemble.ORDER, *assemble.OPTIONAL} <= places.keys()
    assert [name for name in assemble.ORDER if not phases & vars(import_module(places[name])).keys()] == []


def test_many_starts_are_checked_without_compiling(monkeypatch):
    system = assemble.assemble(scenes.coupled())
    limits, numbers = assemble.StartLimits(system), np.array([item.at(0.0) for item in system.parameters])
    monkeypatch.setattr(symengine, "Lambdify", None)
    for part in (1.0, 0.99, 0.98):  # code for a bound of the rounding of many terms takes seconds
        limits.check(part * system.initial_state(system.given_values), numbers)

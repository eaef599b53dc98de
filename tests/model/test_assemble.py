"""Components are found by their files, and each states something in a phase."""

from importlib import import_module

from surfacechem.model import assemble


def test_every_component_that_has_a_place_states_something_in_a_phase():
    places, phases = assemble._places(), {phase for group in assemble.PHASES for phase in group}
    assert {*assemble.ORDER, *assemble.OPTIONAL} <= places.keys()
    assert [name for name in assemble.ORDER if not phases & vars(import_module(places[name])).keys()] == []

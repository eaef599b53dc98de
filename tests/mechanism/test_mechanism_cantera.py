"""The surface mechanisms that come with Cantera: those between surface species agree, others are refused."""

import json
from functools import cache
from pathlib import Path

import cantera as ct
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML
from sampling import every
from test_rates import _quiet, compare  # noqa: F401 - a fixture

from mechanisms import states
from surfacechem.errors import InputError
from surfacechem.mechanism import load_mechanism

FOLDER = next(Path(folder) for folder in ct.get_data_directories() if Path(folder, "ptcombust.yaml").exists())
UNITS = {"length": "cm", "quantity": "mol", "activation-energy": "J/mol"}
SURFACES = {
    ("ptcombust.yaml", "Pt_surf"): 9,
    ("methane_pox_on_pt.yaml", "Pt_surf"): 18,
    ("sofc.yaml", "metal_surface"): 3,
    ("sofc.yaml", "oxide_surface"): 1,
    ("diamond.yaml", "diamond_100"): 2,
    ("SiF4_NH3_mec.yaml", "SI3N4"): 0,
    ("example_data/ammonia-Ru-Ba-YSZ-CSM-2019.yaml", "Ru_surface"): 6,
    ("lithium_ion_battery.yaml", "edge_anode_electrolyte"): 0,
    ("lithium_ion_battery.yaml", "edge_cathode_electrolyte"): 0,
}
"""Cantera's surface phases, and how many of their reactions are between surface species alone."""

REFUSED = {
    ("sofc.yaml", "tpb"): "a contact line has rates per length",
    ("example_data/covdepsurf.yaml", "covdep_cross"): "belongs to no free energy.* give O",
}
LOWERED = [("example_data/covdepsurf.yaml", f"covdep_{model}") for model in ("lin", "pwlin", "poly", "int")]
"""Phases that are taken as they are."""


read = cache(load_mechanism)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Each of these phases once."""
    folder = tmp_path_factory.mktemp("cantera")
    return cache(lambda file, phase: surface_alone(file, phase, folder))


def surface_alone(file: str, phase: str, folder: Path) -> tuple[Path, int]:
    """The phase without its neighbours, and the reactions that it still has."""
    whole = ct.Interface(str(FOLDER / file), phase)
    names = set(whole.species_names)
    kept = [r for r in whole.reactions() if {*r.reactants, *r.products, *r.orders} <= names]
    for reaction in kept:  # twice each, so that none is an undeclared duplicate
        reaction.duplicate = True
    alone = ct.Interface(
        thermo="ideal-surface", kinetics="surface", species=whole.species(), reactions=[*kept, *kept], name="alone"
    )
    alone.site_density = whole.site_density
    path = folder / f"{Path(file).stem}-{phase}.yaml"
    alone.write_yaml(path, units=UNITS)
    written = YAML(typ="safe").load(path)
    del written["phases"][0]["state"]  # in mass fractions, which mean nothing on a surface
    for entry in written["species"]:
        entry.pop("charge", None)  # which the composition says
    path.write_text(json.dumps(written, default=str), encoding="utf-8")
    return path, len(kept)


@pytest.mark.parametrize(("file", "phase"), every(3, [surface for surface, count in SURFACES.items() if count]))
@given(data=st.data())
@settings(max_examples=10)
def test_reactions_between_surface_species_agree(alone, file, phase, data):
    path, count = alone(file, phase)
    assert count == SURFACES[file, phase]
    mechanism = read(path)
    assert len(mechanism.reactions) == 2 * count
    compare(mechanism, *data.draw(states(len(mechanism.variables))))


@pytest.mark.parametrize(("file", "phase"), SURFACES)
def test_neighbours_are_refused_where_rates_are_compiled(file, phase):
    with pytest.raises(InputError, match=r"'adjacent-phases' cannot be used here: gas and bulk .*`solver: cantera`"):
        load_mechanism(FOLDER / file, phase)


@pytest.mark.parametrize(("file", "phase"), REFUSED)
def test_other_phases_are_refused_by_name(file, phase):
    with pytest.raises(InputError, match=f"{Path(file).name}:[0-9]+: .*{REFUSED[file, phase]}"):
        load_mechanism(FOLDER / file, phase)


@pytest.mark.parametrize(("file", "phase"), LOWERED)
@given(data=st.data())
@settings(max_examples=10)
def test_coverage_dependent_thermo_agrees(file, phase, data):
    mechanism = read(FOLDER / file, phase)
    compare(mechanism, *data.draw(states(len(mechanism.variables))))


def test_every_surface_of_cantera_is_in_the_list():
    marks = ("ideal-surface", "edge", "coverage-dependent-surface")
    phases = set()
    for path in FOLDER.rglob("*.yaml"):
        text = path.read_text("utf-8")
        if any(f"thermo: {mark}" in text for mark in marks):
            entries = YAML(typ="safe").load(text)["phases"]
            file = str(path.relative_to(FOLDER))
            phases |= {(file, entry["name"]) for entry in entries if entry.get("thermo") in marks}
    assert phases == {*SURFACES, *REFUSED, *LOWERED}

"""Mechanisms to test with: where they are, random ones, and their evaluation beside Cantera."""

import json
import math
from functools import cache
from itertools import combinations_with_replacement

import cantera as ct
import symengine
from hypothesis import strategies as st
from ruamel.yaml import YAML

from surfacechem.contracts.terms import reads
from surfacechem.documents import mechanisms
from surfacechem.expressions import derivative
from surfacechem.mechanism import load_mechanism
from surfacechem.mechanism.rates import LoadedReaction, kind_of
from surfacechem.quantities import AVOGADRO

KMOL = 1000 * AVOGADRO
SHIPPED = sorted(path.name for path in mechanisms().glob("*.yaml") if "adjacent-phases" not in path.read_text())
"""Those of surface species alone, which become formulas."""


def load(name, bonds=()):
    return _loaded(name, tuple(bonds))


@cache
def _loaded(name, bonds):
    return load_mechanism(mechanisms() / name, bonds=bonds)


def cantera_of(mechanism):
    """Cantera's surface, without what a load does."""
    return ct.Interface(yaml=without_load(mechanism.text), name=mechanism.phase)


@cache
def without_load(text):
    """A mechanism whose loaded rates are the Arrhenius rates that they are without load; others stay as written."""
    plain = json.loads(text) if text.startswith("{") else YAML(typ="safe").load(text)
    types = {entry["type"]: kind_of(entry["type"]) for entry in plain.get("reactions", []) if "type" in entry}
    loaded = {name: law for name, law in types.items() if not law.native}
    for entry in plain.get("reactions", []):
        if entry.get("type") in loaded:
            for key in loaded[entry.pop("type")].own_keys():
                entry.pop(key, None)
    return json.dumps(plain) if loaded else text


def pulled(mechanism, T, gap, force):
    """Cantera's surface of a mechanism under load: elastic energy as enthalpy, factors of rates as multipliers."""
    surface = cantera_of(mechanism)
    for k, item in enumerate(species_of(mechanism)):
        if item.spring:
            add_enthalpy(surface, k, item.spring.energy(gap) * KMOL)
    point = values(mechanism, T, [1.0] * surface.n_species, gap=gap, force=force)
    for i, law in enumerate(mechanism.reactions):
        if isinstance(law, LoadedReaction):
            surface.set_multiplier(math.exp(call(law.log_factor, point | {"f": point[law.load]})), i)
    surface.TP = T, ct.one_atm
    return surface


def add_enthalpy(surface, k, energy):
    """Shift the enthalpy [J/kmol] of a species of constant heat capacity."""
    species = surface.species(k)
    thermo = species.thermo
    assert isinstance(thermo, ct.ConstantCp)
    T_0, h, s, cp = thermo.coeffs
    species.thermo = ct.ConstantCp(
        thermo.min_temp, thermo.max_temp, thermo.reference_pressure, [T_0, h + energy, s, cp]
    )
    surface.modify_species(k, species)


def species_of(mechanism):
    """Species in the order of the coverages, with their springs."""
    (mixture,) = mechanism.potentials
    return mixture.species


def values(mechanism, T, coverages, stretch=1.0, gap=0.0, force=0.0):
    """What the laws read at a temperature, coverages in the order of the species, a gap and a force that bonds
    without a spring share.
    """
    point = {"T_c": T, "g_n": gap, "f": force}
    for item in species_of(mechanism):
        if item.spring:
            point[f"f_{item.variable}"] = item.spring.stiffness * (gap - item.spring.rest_length)
    for variable, theta in zip(mechanism.variables, coverages, strict=True):
        point |= {
            variable.name: theta,
            f"N_{variable.name}": variable.density,
            f"n_{variable.name}": variable.density / stretch,
        }
    return point


def call(formula, point):
    return formula(**{name: point[name] for name in reads(formula)})


def partial_molar(mechanism, point):
    """Chemical potential, enthalpy, entropy and heat capacity of each species, by differentiating the potential.

    [J/mol, J/mol, J/(mol K), J/(mol K)]
    """
    symbols = {name: symengine.Symbol(name) for name in point}
    (potential,) = mechanism.potentials
    psi = call(potential.energy, symbols)
    T = symbols["T_c"]
    rows = []
    for variable in mechanism.variables:
        mu = AVOGADRO * derivative(psi, symbols[variable.name]) / symbols[f"N_{variable.name}"]
        s = -derivative(mu, T)
        rows += [mu, mu + T * s, s, T * derivative(s, T)]
    numbers = symengine.Lambdify(list(symbols.values()), rows)([point[name] for name in symbols])
    return list(zip(*(numbers[k::4] for k in range(4)), strict=True))


# -- random mechanisms ------------------------------------------------------------------------------------------------

number = st.floats(-1, 1, allow_nan=False, allow_subnormal=False)


@st.composite
def thermo(draw):
    model = draw(st.sampled_from(["constant-cp", "NASA7", "NASA9", "Shomate"]))
    if model == "constant-cp":
        return {
            "model": model,
            "T0": 298.15 + 20 * draw(number),
            "h0": 8e7 * draw(number),
            "s0": 1e5 * draw(number),
            "cp0": 5e4 * abs(draw(number)),
        }
    scales = {
        "NASA7": [4, 3e-3, 1e-6, 1e-9, 1e-13, 8e3, 10],
        "NASA9": [1e4, 1e2, 4, 3e-3, 1e-6, 1e-9, 1e-13, 8e3, 10],
        "Shomate": [30, 10, 5, 2, 0.1, 60, 100],
    }[model]
    ranges = draw(st.sampled_from([[250.0, 1500.0], [250.0, 500.0, 1500.0]]))
    data = [[scale * draw(number) for scale in scales] for _ in ranges[1:]]
    return {"model": model, "temperature-ranges": ranges, "data": data}


@st.composite
def reaction(draw, names, sizes):
    """A reaction that keeps the sites, or None where the species allow none."""
    sides = [c for n in (1, 2, 3) for c in combinations_with_replacement(range(len(names)), n)]
    reactants = draw(st.sampled_from([side for side in sides if len(side) < 3]))
    total = sum(sizes[i] for i in reactants)
    products = [side for side in sides if side != reactants and sum(sizes[i] for i in side) == total]
    if not products:
        return None
    chosen = draw(st.sampled_from(products))
    reversible = draw(st.booleans())
    left, right = (" + ".join(names[i] for i in side) for side in (reactants, chosen))
    entry = {
        "equation": f"{left} {'<=>' if reversible else '=>'} {right}",
        "rate-constant": {
            "A": 10 ** (6 + 4 * draw(number)),
            "b": draw(st.sampled_from([0.0, 0.5, -1.3])),
            "Ea": 6e7 * draw(number),
        },
        "duplicate": True,
    }
    if draw(st.booleans()):
        a, m, energies = draw(number), draw(number), range(draw(st.integers(1, 4)))
        terms = {"a": a, "m": m, "E": [1e7 * draw(number) for _ in energies]}
        entry["coverage-dependencies"] = {draw(st.sampled_from(names)): terms}
    if not reversible and draw(st.booleans()):
        entry["orders"] = {names[reactants[0]]: draw(st.sampled_from([0.5, 1.0, 2.0, 1.7]))}
    return entry


@st.composite
def mechanism_texts(draw):
    sizes = draw(st.lists(st.sampled_from([1, 1, 2, 3]), min_size=2, max_size=5))
    names = [f"X{i}(s)" for i in range(len(sizes))]
    entries = [draw(reaction(names, sizes)) for _ in range(draw(st.integers(1, 5)))]
    species = [
        {"name": name, "composition": {}, "sites": size, "thermo": draw(thermo())}
        for name, size in zip(names, sizes, strict=True)
    ]
    phase = {
        "name": "surface",
        "thermo": "ideal-surface",
        "kinetics": "surface",
        "species": "all",
        "reactions": "all",
        "site-density": 10 ** (-8 + 2 * draw(number)),
        "state": {"T": 300.0, "coverages": {names[0]: 1.0}},
    }
    # Two of each kind, so that every reaction is the duplicate of another.
    reactions = [entry for entry in entries if entry] * 2
    units = {"length": "m", "quantity": "kmol", "activation-energy": "J/kmol"}
    return json.dumps({"units": units, "phases": [phase], "species": species, "reactions": reactions})


@st.composite
def states(draw, n):
    T = draw(st.floats(300.0, 1200.0))
    weights = [math.exp(-12 * abs(draw(number))) for _ in range(n)]
    return T, [weight / sum(weights) for weight in weights]


loads = st.fixed_dictionaries({"gap": st.floats(-1e-9, 8e-9), "force": st.floats(-20e-12, 60e-12)})
"""Gaps [m] and forces per bond [N] of single molecules."""

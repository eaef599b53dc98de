"""From the document of a case to its scene."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from surfacechem import laws
from surfacechem.contracts.terms import BodyEnergy, Friction, HeatTransfer, Limit, Load, Potential, RateLaw, Spec
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, suggestion
from surfacechem.format.conduction import read_conduction
from surfacechem.format.fields import choice, items, mapping, number
from surfacechem.format.laws import build, history, law, law_list
from surfacechem.format.mechanics import MOVING, STIFFNESS_KEYS, read_mountings, read_programme
from surfacechem.format.mechanism import read_mechanism
from surfacechem.format.medium import read_medium
from surfacechem.model.assemble import LOADABLE
from surfacechem.quantities import INTERNAL, VARIABLES
from surfacechem.scene import Body, Interface, Scene, Sites

INTERFACE_KEYS = (
    *("temperature", "sites", "partition", "medium", "potential", "friction", "bonding", "limits", "mechanism"),
)

NODE = re.compile(r"T[A-Za-z0-9_]*")
"""Names of temperatures start with T, so that they never clash with another quantity."""

OWNERS = {"T_1": 0, "T_2": 1, "T_c": 2}
"""Names that stand for the temperature of body 1, of body 2 and of the interface."""

BODY_KEYS = ("temperature", "capacity", "conduction", *STIFFNESS_KEYS)
"""What a body may have beside the parameters of its energy."""

BODY_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
TAKEN = ("interface", "surroundings", "reference")
TEMPERATURE = Spec("K", "temperature", above=0)


@dataclass(frozen=True)
class Source:
    """What a scene is read from: the top level of the document and what the mechanism needs."""

    top: Mapping[str, Tree]
    base: str = "."
    mechanism_text: str | None = None
    evaluate: bool = False
    """Whether the run can ask Cantera for rates that are not lowered."""


class SceneReader:
    """Reads the parts of a scene; each part knows the names that the others have given."""

    def __init__(self, source: Source) -> None:
        self.top = source.top
        self.bodies = self._body_trees()
        self.interface = mapping(source.top.get("interface"), INTERFACE_KEYS)
        self.mechanism = read_mechanism(
            self.interface.get("mechanism"), source.base, source.mechanism_text, source.evaluate
        )
        self.temperatures = self._temperatures()
        coverages = [variable.name for variable in self.mechanism.variables] if self.mechanism else []
        self.units = {name: quantity.unit for name, quantity in VARIABLES.items() if name not in INTERNAL}
        self.units |= dict.fromkeys(self.nodes, "K") | dict.fromkeys(coverages, "1")

    @property
    def nodes(self) -> list[str]:
        """Names of the temperatures."""
        return list(dict.fromkeys(name for name in self.temperatures if isinstance(name, str)))

    def scene(self) -> Scene:
        """The whole scene."""
        first, second = (self._body(k, name) for k, name in enumerate(self.bodies))
        interface, loading = self._interface(), self._loading()
        surroundings = self._surroundings()
        bodies = {name: self._body_fields(tree) for name, tree in self.bodies.items()}
        mountings = read_mountings(self.top.get("mechanics"), bodies, self.units)
        return Scene(
            bodies=(first, second),
            interface=interface,
            heat=self._heat(),
            loading=loading,
            surroundings=surroundings,
            T_0=self._reference_temperature(),
            initial=self._initial(interface, loading, (first, second), moves=bool(mountings)),
            programme=read_programme(self.top.get("programme"), self.units),
            **mountings,
        )

    # -- bodies and temperatures ----------------------------------------------------------------------------------

    def _body_trees(self) -> dict[str, Tree]:
        bodies = mapping(self.top["bodies"])
        if len(bodies) != 2:
            raise self.top["bodies"].error(f"exactly two bodies are needed, not {len(bodies)}; the first is body 1.")
        for name, tree in bodies.items():
            if not BODY_NAME.fullmatch(name) or name in TAKEN:
                raise tree.error(f"'{name}' cannot name a body: use letters, digits, - and _, and none of {TAKEN}.")
        return bodies

    def _temperatures(self) -> tuple[str | Load | None, ...]:
        """Temperature of body 1, of body 2 and of the interface."""
        trees = [mapping(tree).get("temperature") for tree in self.bodies.values()]
        for name, body in self.bodies.items():
            if "temperature" not in self._body_fields(body):
                raise body.error(f"{name} needs `temperature`: a name such as T, or a value.")
        trees.append(self.interface.get("temperature"))
        found = [self._temperature(tree) if tree is not None else None for tree in trees]
        for node, tree in zip(found, trees, strict=True):
            if isinstance(node, str) and tree is not None:
                self._check_owner(node, tree, found)
        return tuple(found)

    def _temperature(self, tree: Tree) -> str | Load:
        value = tree.value
        if not isinstance(value, str) or not value.isidentifier():
            load = history(tree, "K", {name: quantity.unit for name, quantity in VARIABLES.items()})
            return self._above_zero(load, tree)
        if not NODE.fullmatch(value) or value == "T_0":
            hint = "T_0 is the reference temperature" if value == "T_0" else f"start it with T, for example T_{value}"
            raise tree.error(f"'{value}' cannot name a temperature: {hint}.")
        return value

    def _check_owner(self, name: str, tree: Tree, found: list[str | Load | None]) -> None:
        if name in ("T_a", "T_from", "T_to") or (name in OWNERS and found[OWNERS[name]] != name):
            raise tree.error(f"'{name}' is {VARIABLES[name].long_name}, which has its own; use another name.")

    def _above_zero(self, load: Load, tree: Tree) -> Load:
        """Refuse a history of a temperature that starts at or below zero."""
        start = float(load.bind(load.piece(0.0)).value(0.0))
        if not start > 0:
            raise tree.error(f"{start:g} K is not an absolute temperature above zero.")
        return load

    def _body_kind(self, tree: Tree) -> type[BodyEnergy]:
        kinds = laws.laws(BodyEnergy)
        capacity = mapping(tree).get("capacity")
        name = choice(capacity, "capacity", kinds) if capacity is not None else "quadratic"
        return cast(type[BodyEnergy], kinds[name])

    def _body_fields(self, tree: Tree) -> dict[str, Tree]:
        parameters = [name for name, _ in self._body_kind(tree).specs()]
        return mapping(tree, [*BODY_KEYS, *parameters])

    def _body(self, k: int, name: str) -> Body:
        tree, temperature = self.bodies[name], self.temperatures[k]
        assert temperature is not None
        fields = self._body_fields(tree)
        given = {key: child for key, child in fields.items() if key not in BODY_KEYS}
        stores = given or "capacity" in fields
        energy = build(self._body_kind(tree), tree, self.units, fields=given) if stores else None
        if "conduction" not in fields:
            return Body(name, temperature, energy)
        if energy is None:
            raise fields["conduction"].error(f"{name} conducts heat but stores none: give it a heat capacity C.")
        return Body(name, temperature, energy, read_conduction(fields["conduction"], self.units, self._above_zero))

    # -- interface ------------------------------------------------------------------------------------------------

    def _interface(self) -> Interface:
        given, mechanism = self.interface, self.mechanism
        potentials = law_list(Potential, given.get("potential"), self.units)
        reactions = law_list(RateLaw, given.get("bonding"), self.units)
        frictions = law_list(Friction, given.get("friction"), self.units)
        limits = law_list(Limit, given.get("limits"), self.units)
        sites = self._sites()
        partition, loss = self._partition()
        medium = read_medium(given.get("medium"), self.units)
        if mechanism is None:
            return Interface(
                self.temperatures[2],
                potentials,
                frictions,
                reactions,
                sites,
                partition,
                limits=limits,
                loss=loss,
                medium=medium,
            )
        return Interface(
            self.temperatures[2],
            (*potentials, *mechanism.potentials),
            frictions,
            (*reactions, *mechanism.reactions),
            mechanism.sites,
            partition,
            mechanism.variables,
            mechanism.bonds,
            limits,
            loss,
            medium,
            mechanism.engine,
            mechanism.remarks,
        )

    def _partition(self) -> tuple[float, float]:
        """Fractions of the heat into body 1 and into the surroundings."""
        tree = self.interface.get("partition")
        if tree is None:
            return 0.5, 0.0
        if "temperature" in self.interface:
            raise tree.error("an interface with a temperature divides its heat by itself; remove `partition`.")
        spec = Spec("1", "fraction of heat", at_least=0, at_most=1)
        if not isinstance(tree.value, dict):
            return number(tree, "1", "partition", spec), 0.0
        first, second = self.bodies
        given = mapping(tree, [first, second, "surroundings"])
        shares = {name: number(child, "1", name, spec) for name, child in given.items()}
        if abs(sum(shares.values()) - 1) > 1e-9:
            raise tree.error(f"the fractions of the heat must add up to 1, not {sum(shares.values()):g}.")
        if shares.get("surroundings") and "surroundings" not in self.top:
            raise tree.error("the surroundings have no temperature. Add `surroundings: {temperature: ...}`.")
        return shares.get(first, 0.0), shares.get("surroundings", 0.0)

    def _sites(self) -> Sites | None:
        tree = self.interface.get("sites")
        if tree is None:
            return None
        if self.mechanism is not None:
            raise tree.error("the mechanism gives the sites; remove `sites` or `mechanism`.")
        spec = Spec("1/m^2", "site density", above=0)
        if not isinstance(tree.value, dict):
            density = number(tree, spec.unit, "sites", spec)
            return Sites(density, density)
        names = list(self.bodies)
        fields = mapping(tree, [*names, "reference"])
        for name in names:
            if name not in fields:
                raise tree.error(f"the sites of {name} are missing: give both bodies a density.")
        first, second = (number(fields[name], spec.unit, "sites", spec) for name in names)
        reference = choice(fields["reference"], "body", names) if "reference" in fields else names[0]
        return Sites(first, second, names.index(reference) + 1)

    # -- heat, loading, initial values ----------------------------------------------------------------------------

    def _heat(self) -> tuple[HeatTransfer, ...]:
        trees = items(self.top.get("heat"), "- conductance: {between: [...], h: ...}")
        return tuple(self._heat_path(tree) for tree in trees)

    def _heat_path(self, tree: Tree) -> HeatTransfer:
        path: Any = law(HeatTransfer, tree, self.units)
        ends = [*self.bodies, "interface", "surroundings"]
        place = next(iter(tree.value.values())).value["between"].place
        for end in path.between:
            if end not in ends:
                raise InputError(f"no end '{end}'.{suggestion(end, ends)}", place)
        if path.between[0] == path.between[1]:
            raise InputError(f"a heat path needs two different ends, not {path.between[0]} twice.", place)
        if "surroundings" in path.between and "surroundings" not in self.top:
            raise InputError("the surroundings have no temperature. Add `surroundings: {temperature: ...}`.", place)
        through = path.closure != "direct" or "interface" in path.between
        if through and "temperature" not in self.interface:
            raise InputError("the interface has no temperature. Add `interface.temperature`.", place)
        return cast(HeatTransfer, path)

    def _surroundings(self) -> Load | None:
        if "surroundings" not in self.top:
            return None
        fields = mapping(self.top["surroundings"], ["temperature"])
        if "temperature" not in fields:
            raise self.top["surroundings"].error("the surroundings need a `temperature`.")
        return self._above_zero(history(fields["temperature"], "K", self.units), fields["temperature"])

    def _loading(self) -> dict[str, Load]:
        fields = mapping(self.top.get("loading"), [*LOADABLE, *self.nodes], "variables")
        loads = {name: history(tree, self.units[name], self.units) for name, tree in fields.items()}
        for name in set(loads) & set(self.nodes):
            self._above_zero(loads[name], fields[name])
        return loads

    def _reference_temperature(self) -> float | None:
        return number(self.top["T_0"], "K", "T_0", TEMPERATURE) if "T_0" in self.top else None

    def _initial(
        self, interface: Interface, loading: Mapping[str, Load], bodies: tuple[Body, Body], moves: bool
    ) -> dict[str, float]:
        evolving = [name for name in self.nodes if name not in loading]
        evolving += [
            f"profile_{k}" for k, body in enumerate(bodies, start=1) if body.conduction and body.conduction.cells
        ]
        if interface.limits or any("phi" in reaction.stoichiometry() for reaction in interface.reactions):
            evolving += ["phi", "ln_phi"]
        if moves or "programme" in self.top or {"F_n", "F_t", "F_t2", "u_t"} & set(loading):
            evolving += [name for name in MOVING if name not in loading]
        evolving += [name for law in interface.frictions for name in law.internal.values()]
        tree = self.top.get("initial")
        fields = mapping(tree)
        for name, child in fields.items():
            if name not in evolving and not (name == "coverages" and self.mechanism):
                raise child.error(self._no_initial(name, loading, evolving))
        values = {name: self._initial_value(name, fields[name], interface) for name in evolving if name in fields}
        if self.mechanism is not None:
            if tree is None or "coverages" not in fields:
                remedy = "add `initial: {coverages: {species: value}}`."
                raise (tree or self.interface["mechanism"]).error(f"the coverages of the mechanism: {remedy}")
            given = {name: number(child, "1", name) for name, child in mapping(fields["coverages"]).items()}
            values |= self.mechanism.coverages(given, fields["coverages"].place)
        return values

    def _no_initial(self, name: str, loading: Mapping[str, Load], evolving: list[str]) -> str:
        if name in loading:
            return f"{name} is prescribed under `loading`, so it has no initial value; remove one of them."
        if name == "phi":
            return "nothing evolves phi. Give a law under `bonding`, or remove it."
        return f"nothing that evolves is called '{name}'.{suggestion(name, evolving)}"

    def _initial_value(self, name: str, tree: Tree, interface: Interface) -> float:
        if name in (*MOVING, "ln_phi", "theta"):
            return number(tree, self.units[name], name)
        if name != "phi":
            return number(tree, "K", name, TEMPERATURE)
        limit = interface.sites.phi_max if interface.sites else 1.0
        return number(tree, "1", name, Spec("1", "initial bonding state", at_least=0, at_most=limit))

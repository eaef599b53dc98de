"""How the bodies are mounted, and the stages of a programme, as a case states them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from surfacechem.contracts.terms import Spec
from surfacechem.documents.document import Tree
from surfacechem.format.fields import choice, items, mapping, number, shown, text
from surfacechem.format.laws import build
from surfacechem.model.assemble import LOADABLE, TRACTIONS
from surfacechem.scene import Mounting, Stage
from surfacechem.units import quotient

MECHANICS_KEYS = ("normal", "tangential", "transverse")
STIFFNESS_KEYS = ("stiffness", "E", "H")
STAGE_KEYS = ("for", "until")
WAYS = ("rises-to", "falls-to")

MOVING = ("g_n", "v_n", "u_t", "u_t2", "v_t", "v", "v_2", "g_t", "w_n", "w_t", "w_t2", "F_n", "F_t", "F_t2", "p")
"""Variables beside temperatures and bonds that may evolve, and then have an initial value."""

STIFFNESS = Spec("Pa/m", "stiffness of the body", above=0)
MODULUS = Spec("Pa", "Young's modulus", above=0)
HEIGHT = Spec("m", "height", above=0)


def read_mountings(
    tree: Tree | None, bodies: Mapping[str, Mapping[str, Tree]], units: Mapping[str, str]
) -> dict[str, Mounting]:
    """Mountings by direction, as the fields of a scene; stiff bodies in series hold the normal gap."""
    fields = mapping(tree, MECHANICS_KEYS)
    found = {name: build(Mounting, child, units) for name, child in fields.items()}
    k = _series(bodies)
    if k is not None:
        normal = found.get("normal")
        if normal is not None and normal.k:
            raise fields["normal"].error("the stiffness has two roles: give `k` here or a stiffness to the bodies.")
        found["normal"] = replace(normal, k=k) if normal is not None else Mounting(k=k)
    return found


def _series(bodies: Mapping[str, Mapping[str, Tree]]) -> float | None:
    """Stiffness [Pa/m] of the bodies in series: 1/k = H_1/E_1 + H_2/E_2; a body that gives none is rigid."""
    stiffness = [_body_stiffness(fields) for fields in bodies.values()]
    given = [value for value in stiffness if value is not None]
    return 1 / sum(1 / value for value in given) if given else None


def _body_stiffness(fields: Mapping[str, Tree]) -> float | None:
    if "stiffness" in fields:
        for name in ("E", "H"):
            if name in fields:
                raise fields[name].error("the stiffness has two roles: give `stiffness`, or `E` and `H`.")
        return number(fields["stiffness"], STIFFNESS.unit, "stiffness", STIFFNESS)
    if "E" not in fields and "H" not in fields:
        return None
    for name, other in (("E", "H"), ("H", "E")):
        if name not in fields:
            raise fields[other].error(f"a body's stiffness is E / H; `{name}` is missing.")
    return number(fields["E"], MODULUS.unit, "E", MODULUS) / number(fields["H"], HEIGHT.unit, "H", HEIGHT)


def read_programme(tree: Tree | None, units: Mapping[str, str]) -> tuple[Stage, ...]:
    """The stages of the loading."""
    found = tuple(_stage(item, units) for item in items(tree, "- approach: {w_n: -1 um/s, until: {p: 10 kPa}}"))
    for stage in found[:-1]:
        if stage.duration is None and not stage.variable and not stage.event:
            assert stage.place is not None
            assert tree is not None
            raise tree.error(f"only the last stage may be without end: give {stage.name} `for` or `until`.")
    return found


def _stage(item: Tree, units: Mapping[str, str]) -> Stage:
    if not isinstance(item.value, dict) or len(item.value) != 1:
        raise item.error(f"a stage is `name: {{rates, for or until}}`, not {shown(item)}.")
    ((name, tree),) = item.value.items()
    fields = mapping(tree, [*LOADABLE, *STAGE_KEYS])
    moved = {key: child for key, child in fields.items() if key not in STAGE_KEYS}
    rates = {key: number(child, quotient(units[key], "s"), key) for key, child in moved.items()}
    if "for" in fields and "until" in fields:
        raise fields["until"].error("the stage has two ends: give `for` or `until`.")
    stage = Stage(name, rates, place=tree.place)
    if "for" in fields:
        return replace(stage, duration=number(fields["for"], "s", "for", Spec("s", "length of the stage", above=0)))
    return _until(stage, fields["until"], units) if "until" in fields else stage


def _until(stage: Stage, tree: Tree, units: Mapping[str, str]) -> Stage:
    if not isinstance(tree.value, dict):
        return replace(stage, event=text(tree, "until"))
    if len(tree.value) != 1:
        raise tree.error("`until` waits for one variable, for example `until: {p: 10 kPa}`.")
    ((variable, child),) = tree.value.items()
    known = {**units, **dict.fromkeys(TRACTIONS, "Pa")}
    unit = known.get(choice(replace(child, value=variable), "variable", known), "1")
    if not isinstance(child.value, dict):
        return replace(stage, variable=variable, value=number(child, unit, variable))
    way = mapping(child, WAYS)
    if len(way) != 1:
        raise child.error("give `rises-to` or `falls-to`.")
    ((direction, value),) = way.items()
    return replace(stage, variable=variable, value=number(value, unit, variable), rising=direction == "rises-to")

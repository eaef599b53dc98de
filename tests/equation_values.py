"""What the assembled equations of every scene give at a fixed point, for the approved table of these values.

    python tests/equation_values.py

writes the table anew. A difference to the one before is a change of an equation, of what ends or interrupts a run, of
a jump or of a booking; conservation laws and exact solutions say whether it is right.
"""

import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import thermodynamics as laws
from zoo import MEMBERS, Member

from surfacechem.model.system import System

TABLE = Path(__file__).with_suffix(".json")


def parts(system: System) -> Iterator[tuple[str, Any]]:
    """Everything that is an expression, by name."""
    for kind, items in (
        ("row", system.rows.items()),
        ("output", ((item.name, item.expression) for item in system.outputs)),
        ("account", ((account.quantity.name, account.rate) for account in system.ledger)),
        ("margin", ((margin.name, margin.masked) for margin in system.margins)),
        ("residual", ((e.state, e.residual) for e in system.equilibria)),
        ("size", ((e.state, e.size) for e in system.equilibria)),
        ("transition", ((edge.name, edge.masked) for edge in system.edges)),
        ("start of mode", ((m.name, m.start) for m in system.modes if m.start is not None)),
        ("given", system.far_work.items()),
    ):
        yield from ((f"{kind} {name}", expression) for name, expression in items)
    for edge in system.edges:
        for symbol, value in {**edge.modes, **edge.reset}.items():
            yield f"{edge.name}: {symbol}", value
        if edge.fold:
            yield f"{edge.name}: tangent", edge.fold.tangent
    for kind, sinks in system.sinks.items():
        for sink in sinks:
            yield f"{kind} sink {sink.node}", sink.share


def away(member: Member) -> tuple[System, dict[Any, Any]]:
    """A scene in its modes, and a point away from equilibrium, with rates drawn at random."""
    system, draw = member.system, random.Random(member.name)
    point = laws.start_point(system, 0, member.modes)
    laws.put_away(system, point, lambda _: draw)
    return system, point


def computed(member: Member) -> dict[str, float]:
    """All values of a scene there."""
    system, point = away(member)
    return {key: float(laws.number(system.expand(value), point)) for key, value in parts(system)}


if __name__ == "__main__":
    rows = [f"{json.dumps(m.name)}: {json.dumps(computed(m))}" for m in MEMBERS.values() if "scene" in m.tags]
    TABLE.write_text("{\n" + ",\n".join(rows) + "\n}\n")

"""A drawing of a scene: two bodies, the interface between them, heat paths, springs, and what is given."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle

from surfacechem.contracts.terms import Load
from surfacechem.plots import style
from surfacechem.scene import Body, Mounting, Scene

BODY, MEDIUM, HEAT, SPRING, GIVEN = "#e8eaee", "#f6d8a8", "#c0392b", "#33475b", "#1f6f4a"
WIDTH, HEIGHT, GAP = 4.0, 1.25, 0.34
"""Of the drawing: width and height of a body, and the height of the interface between the two."""

PLACES = {"interface": GAP / 2, "surroundings": 0.0}
COILS = 5


def figure(scene: Scene) -> Figure:
    """The drawing; body 1 is the lower one."""
    with matplotlib.rc_context(style.STYLE):
        drawing = Figure(figsize=(6.4, 3.9), layout="constrained")
        axes = drawing.add_subplot()
        axes.set_axis_off()
        axes.set_xlim(-2.9 if scene.heat else -0.1, WIDTH + (1.0 if scene.tangential else 0.1))
        axes.set_ylim(-HEIGHT - 0.35, GAP + HEIGHT + (0.1 if scene.normal is None else 0.75))
        # Body 1 is below, as the gap g = x_2 - x_1 opens upwards.
        lower, upper = scene.bodies
        _body(axes, lower, -HEIGHT)
        _body(axes, upper, GAP)
        _interface(axes, scene)
        _heat(axes, scene)
        if scene.normal is not None:
            _spring(axes, scene.normal, (WIDTH / 2, GAP + HEIGHT), (WIDTH / 2, GAP + HEIGHT + 0.55))
        if scene.tangential is not None:
            middle = GAP + HEIGHT / 2
            _spring(axes, scene.tangential, (WIDTH, middle), (WIDTH + 0.85, middle))
        _given(axes, scene)
        return drawing


def _temperature(temperature: str | Load | None) -> str:
    """What a member's temperature is, in words."""
    if temperature is None:
        return "no temperature of its own"
    if isinstance(temperature, Load):
        return f"{temperature.at_start():g} K, given"
    return f"temperature {temperature}"


def _body(axes: Axes, body: Body, bottom: float) -> None:
    axes.add_patch(Rectangle((0, bottom), WIDTH, HEIGHT, facecolor=BODY, edgecolor=SPRING))
    lines = [_temperature(body.temperature)]
    lines += [f"capacity: {body.energy.title}"] if body.energy else ["reservoir"]
    lines += [f"conducts, {body.conduction.cells or 'as one lump:'} cells"] if body.conduction else []
    middle = bottom + HEIGHT / 2
    axes.text(WIDTH / 2, middle + 0.24, body.name, ha="center", va="center", weight="bold", fontsize=10)
    axes.text(WIDTH / 2, middle - 0.04, "\n".join(lines), ha="center", va="top", fontsize=8, linespacing=1.4)


def _interface(axes: Axes, scene: Scene) -> None:
    interface = scene.interface
    axes.add_patch(Rectangle((0, 0), WIDTH, GAP, facecolor=MEDIUM, edgecolor=SPRING, hatch="..", alpha=0.6))
    axes.text(
        WIDTH / 2, GAP / 2, f"interface: {_temperature(interface.temperature)}", ha="center", va="center", fontsize=8,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip


def _heat(axes: Axes, scene: Scene) -> None:
    """Heat paths as arrows beside the bodies, one for all that run between the same ends."""
    first, second = (body.name for body in scene.bodies)
    ends = {first: -HEIGHT / 2, second: GAP + HEIGHT / 2, **PLACES}
    paths: dict[tuple[str, ...], list[str]] = {}
    for law in scene.heat:
        paths.setdefault(tuple(sorted(law.between)), []).append(law.title)
    for k, (between, titles) in enumerate(paths.items()):
        low, high = sorted(ends[end] for end in between)
        x = -0.22 - 0.3 * k  # beside each other, as several may reach from body to body
        start, stop, text = (x, low), (x, high), "\n".join(titles)
        if "surroundings" in between:
            level = ends[next(end for end in between if end != "surroundings")]
            start, stop, text = (0.0, level), (-0.9, level), f"{text}\nto the surroundings"
        axes.add_patch(FancyArrowPatch(start, stop, arrowstyle="<->", mutation_scale=10, color=HEAT, linewidth=1.3))
        axes.text(-1.05, (start[1] + stop[1]) / 2, text, color=HEAT, ha="right", va="center", fontsize=8)


def _spring(axes: Axes, mounting: Mounting, start: tuple[float, float], end: tuple[float, float]) -> None:
    """A spring from a body to a wall, with what the mounting has."""
    along, across = np.subtract(end, start), np.subtract(end, start)[::-1]
    ways = np.concatenate([[0.0, 0.2], np.linspace(0.2, 0.8, 2 * COILS), [0.8, 1.0]])
    sides = np.concatenate([[0.0, 0.0], 0.12 * (-1.0) ** np.arange(2 * COILS), [0.0, 0.0]])
    line = np.array(start) + ways[:, None] * along + sides[:, None] * across / np.linalg.norm(across)
    axes.plot(*line.T, color=SPRING, linewidth=1.2)
    wall = np.array(end) + np.array([[-0.35], [0.35]]) * across / np.linalg.norm(across)
    axes.plot(*wall.T, color=SPRING, linewidth=2.5)
    parts = {"k": mounting.k, "m": mounting.m, "damper": mounting.c_b + mounting.c_g}
    text = ", ".join(name for name, value in parts.items() if value) or "dead load"
    # Beside a spring that stands upright there is room for its words, over one that lies.
    above = end[0] == start[0]
    place = (end[0] + 0.45, end[1] - 0.2) if above else ((start[0] + end[0]) / 2, end[1] + 0.42)
    axes.text(*place, text, ha="left" if above else "center", va="center", fontsize=8, color=SPRING)


def _given(axes: Axes, scene: Scene) -> None:
    """What acts in the interface, and what is given, beside it."""
    interface = scene.interface
    rows: list[tuple[str, Sequence[str]]] = [
        ("energy", [law.title for law in interface.potentials]),
        ("bonds", [law.title for law in interface.reactions]),
        ("friction", [law.title for law in interface.frictions]),
        ("gives way", [law.title for law in interface.limits]),
        ("given", list(scene.loading)),
        ("stages", [stage.name for stage in scene.programme]),
    ]
    shown = [f"{word}: {_few(names)}" for word, names in rows if names]
    axes.text(WIDTH / 2, -HEIGHT - 0.1, "\n".join(shown), ha="center", va="top", fontsize=8, color=GIVEN)
    axes.set_ylim(-HEIGHT - 0.35 - 0.2 * len(shown), axes.get_ylim()[1])


def _few(names: Sequence[str]) -> str:
    # Reactions of a mechanism may be many.
    unique = list(dict.fromkeys(names))
    return ", ".join(unique[:4]) + (f" and {len(unique) - 4} more" if len(unique) > 4 else "")

"""Drawing of a scene: two bodies, the interface between them, heat paths, springs, and prescribed variables."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle

from surfacechem.contracts.terms import Load
from surfacechem.errors import listed
from surfacechem.plots import style
from surfacechem.plots.style import symbol
from surfacechem.scene import Body, Mounting, Scene

BODY, MEDIUM, HEAT, SPRING, GIVEN = "#e8eaee", "#f6d8a8", "#c0392b", "#33475b", "#1f6f4a"
WIDTH, HEIGHT, GAP = 2.7, 0.95, 0.26
"""Dimensions of the drawing [inch]: width and height of a body, and the height of the interface between the two."""

BESIDE, OVER, LINE = 1.6, 0.5, 0.145
"""Space [inch] next to the bodies for heat paths, over them for springs and far sides, and height of a line of text."""

SIZE = 7.5
COILS = 5
MOST_LETTERS = 44
"""Largest number of letters in a line below the drawing."""

HEATED_BODY = {"Q_1": 0, "Q_2": 1, "Q_c": None}
"""External heat supplies, and the number of the body that receives them; None for the interface."""


def figure(scene: Scene) -> Figure:
    """Draw a scene; body 1 is the lower one."""
    below = _given(scene)
    left = BESIDE if scene.heat else 0.1
    right = 0.85 if scene.tangential or any(name in scene.loading for name in HEATED_BODY) else 0.1
    # Temperatures beyond the far sides, to which heat passes.
    far = [body.conduction.far if body.conduction else None for body in scene.bodies]
    over = [scene.normal is not None or far[1] is not None, far[0] is not None]
    low, high = -HEIGHT - over[1] * OVER - LINE * len(below) - 0.15, GAP + HEIGHT + over[0] * OVER + 0.15
    with matplotlib.rc_context(style.STYLE):
        drawing = Figure(figsize=(left + WIDTH + right, high - low))
        axes = drawing.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set(xlim=(-left, WIDTH + right), ylim=(low, high))
        # Body 1 is below, as the gap g = x_2 - x_1 opens upwards.
        lower, upper = scene.bodies
        _body(axes, lower, -HEIGHT)
        _body(axes, upper, GAP)
        axes.add_patch(Rectangle((0, 0), WIDTH, GAP, facecolor=MEDIUM, edgecolor=SPRING, hatch="..", alpha=0.6))
        text = f"interface: {_temperature(scene.interface.temperature)}"
        white = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
        axes.text(WIDTH / 2, GAP / 2, text, ha="center", va="center", fontsize=SIZE, bbox=white)
        _heat(axes, scene)
        _far_side(axes, lower, -HEIGHT, -1)
        _far_side(axes, upper, GAP + HEIGHT, 1)
        if scene.normal is not None:
            _spring(axes, scene.normal, (WIDTH / 4, GAP + HEIGHT), (WIDTH / 4, GAP + HEIGHT + OVER))
        if scene.tangential is not None:
            middle = GAP + HEIGHT / 2
            _spring(axes, scene.tangential, (WIDTH, middle), (WIDTH + 0.65, middle))
        for k, line in enumerate(below):
            axes.text(0.0, low + LINE * (len(below) - 0.5 - k) + 0.05, line, va="center", fontsize=SIZE, color=GIVEN)
        return drawing


def _temperature(temperature: str | Load | None) -> str:
    """Describe the temperature of a body or the interface."""
    if temperature is None:
        return "no temperature of its own"
    if isinstance(temperature, Load):
        return f"{temperature.at_start():g} K, given"
    return f"temperature {symbol(temperature)}"


def _body(axes: Axes, body: Body, bottom: float) -> None:
    axes.add_patch(Rectangle((0, bottom), WIDTH, HEIGHT, facecolor=BODY, edgecolor=SPRING))
    lines = [_temperature(body.temperature)]
    lines += [f"capacity: {body.energy.title}"] if body.energy else ["reservoir"]
    if law := body.conduction:
        cells = f"cells to {law.accuracy:g}" if law.accuracy else f"{law.cells} cells"
        lines.append(f"conducts, {cells if law.cells else 'as one lump'}")
    middle = bottom + HEIGHT / 2
    axes.text(WIDTH / 2, middle + 0.26, body.name, ha="center", va="center", weight="bold", fontsize=9)
    axes.text(WIDTH / 2, middle + 0.12, "\n".join(lines), ha="center", va="top", fontsize=SIZE, linespacing=1.35)


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], kind: str = "<->") -> None:
    axes.add_patch(FancyArrowPatch(start, end, arrowstyle=kind, mutation_scale=9, color=HEAT, linewidth=1.2))


def _heat(axes: Axes, scene: Scene) -> None:
    """Draw heat paths as arrows next to the bodies, one for all between the same ends, and external heat supplies."""
    levels = [-HEIGHT / 2, GAP + HEIGHT / 2]
    ends = {body.name: level for body, level in zip(scene.bodies, levels, strict=True)} | {"interface": GAP / 2}
    paths: dict[tuple[str, ...], list[str]] = {}
    for law in scene.heat:
        paths.setdefault(tuple(sorted(law.between)), []).append(law.title)
    inside = [between for between in paths if "surroundings" not in between]
    for between, titles in paths.items():
        words = [line for title in titles for line in wrap(title, 17)]
        if "surroundings" in between:
            level = ends[next(end for end in between if end != "surroundings")] - 0.22
            _arrow(axes, (0.0, level), (-0.5, level))
            words = [r"$\bf{surroundings}$", *words]
            at = -0.55, level
        else:
            low, high = sorted(ends[end] for end in between)
            # Side by side, as several may reach from body to body.
            x = -0.12 - 0.2 * inside.index(between)
            _arrow(axes, (x, low), (x, high))
            at = -0.2 - 0.2 * (len(inside) - 1), (low + high) / 2 + 0.1
        axes.text(*at, "\n".join(words), color=HEAT, ha="right", va="center", fontsize=SIZE)
    for name in HEATED_BODY.keys() & scene.loading.keys():
        k = HEATED_BODY[name]
        level = GAP / 2 if k is None else levels[k]
        _arrow(axes, (WIDTH + 0.45, level), (WIDTH, level), "->")
        axes.text(WIDTH + 0.5, level, symbol(name), color=HEAT, va="center", fontsize=9)


def _far_side(axes: Axes, body: Body, edge: float, way: int) -> None:
    """Draw the temperature at which the far side of a conducting body, or its coolant, is held."""
    if body.conduction is None or body.conduction.far is None:
        return
    end = edge + way * 0.3
    _arrow(axes, (WIDTH / 2, edge), (WIDTH / 2, end))
    text = f"far side: {body.conduction.far.at_start():g} K"
    if not body.conduction.held:
        text += f"\nthrough {body.conduction.h_far:g} W/(m² K)"
    axes.text(WIDTH / 2 + 0.1, edge + way * 0.2, text, color=HEAT, va="center", fontsize=SIZE)


def _spring(axes: Axes, mounting: Mounting, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Draw a spring from a body to a wall, with the elements of the mounting."""
    along, across = np.subtract(end, start), np.subtract(end, start)[::-1]
    across = across / np.linalg.norm(across)
    ways = np.concatenate([[0.0, 0.2], np.linspace(0.2, 0.8, 2 * COILS), [0.8, 1.0]])
    sides = np.concatenate([[0.0, 0.0], 0.08 * (-1.0) ** np.arange(2 * COILS), [0.0, 0.0]])
    axes.plot(*(np.array(start) + ways[:, None] * along + sides[:, None] * across).T, color=SPRING, linewidth=1.2)
    axes.plot(*(np.array(end) + np.array([[-0.25], [0.25]]) * across).T, color=SPRING, linewidth=2.5)
    parts = {"k": mounting.k, "m": mounting.m, "damper": mounting.c_b + mounting.c_g}
    text = ", ".join(name for name, value in parts.items() if value) or "dead load"
    # The text is next to an upright spring, and over a horizontal one.
    above = end[0] == start[0]
    place = (end[0] + 0.32, end[1] - 0.1) if above else (start[0] + 0.05, end[1] + 0.33)
    axes.text(*place, text, va="center", fontsize=SIZE, color=SPRING)


def _given(scene: Scene) -> list[str]:
    """Return lines about the laws of the interface, and about prescribed variables."""
    interface = scene.interface
    rows: list[tuple[str, Sequence[str]]] = [
        ("energy", [law.title for law in interface.potentials]),
        ("bonds", [law.title for law in interface.reactions]),
        ("friction", [law.title for law in interface.frictions]),
        ("gives way", [law.title for law in interface.limits]),
        ("given", [symbol(name) for name in scene.loading]),
        ("stages", [stage.name for stage in scene.programme]),
    ]
    # Up to four names each, since a mechanism may have many reactions.
    texts = [f"{word}: {listed(list(dict.fromkeys(names)), 4)}" for word, names in rows if names]
    lines = ([text] if "$" in text else wrap(text, MOST_LETTERS, subsequent_indent="    ") for text in texts)
    return [line for several in lines for line in several]

"""Figures that are computed when the documentation is built."""

import csv
import re
import tomllib
from collections.abc import Callable
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import execution
import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from mkdocs.structure.files import File, Files

import surfacechem
from surfacechem import format as case
from surfacechem import plots

BLUE, RED, GREEN, PINK = plots.COLOURS[:4]


def on_config(config: Any) -> Any:
    """Let pages of notebooks have what these gave in this process."""
    execution.install()
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the figures to the pages' files."""
    for name, make in FIGURES.items():
        buffer = BytesIO()
        with matplotlib.rc_context(plots.STYLE):
            plots.save(make(), buffer, name.rpartition(".")[2])
        files.append(File.generated(config, f"images/{name}", content=buffer.getvalue()))
    return files


@cache
def computed(name: str) -> Any:
    """Dataset of a shipped case, which several figures show."""
    return surfacechem.run(name).dataset


@cache
def swept(name: str) -> Any:
    """Dataset of its sweep."""
    return surfacechem.sweep(name).dataset


def new(width: float, height: float) -> Figure:
    """An empty figure."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def accuracy() -> Figure:
    """Error achieved and energy residual against the tolerance asked for."""
    cases = {"exothermic": BLUE, "endothermic-kappa-0p99": RED, "sliding-dry": GREEN, "three-temperatures": PINK}
    tolerances = np.logspace(-3, -12, 10)
    figure = new(7.2, 3.0)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for name, colour in cases.items():
        simulation = surfacechem.load(name, ["run.accuracy=1e-3"])
        runs = [simulation.run(run=_at(simulation.case.run, rtol)) for rtol in tolerances]
        left.loglog(tolerances, [r.accuracy.error for r in runs], "o-", color=colour, markersize=3.5, label=name)
        right.loglog(tolerances, [max(r.audit.energy_error, 1e-17) for r in runs], "o-", color=colour, markersize=3.5)
    for ax, text in (
        (left, "largest error against the exact solution"),
        (right, "energy residual, of what is exchanged"),
    ):
        ax.loglog(tolerances, tolerances, color="0.6", linewidth=0.8, linestyle="--")
        ax.set_xlabel("rtol")
        ax.set_title(text, fontsize=9)
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _at(run: Any, rtol: float) -> Any:
    from dataclasses import replace

    return replace(run, rtol=float(rtol))


def signs() -> Figure:
    """Bodies, interface, and which way everything counts."""
    figure = new(6.4, 2.3)
    ax = figure.subplots()
    ax.set(xlim=(0, 10), ylim=(0, 3.4), xticks=[], yticks=[], aspect="equal")
    for side in ax.spines.values():
        side.set_visible(False)
    for x, colour, text in (
        (0.2, "#dbe9f4", "body 1\n$T_1,\\;U_1,\\;S_1$"),
        (6.8, "#f9e2d2", "body 2\n$T_2,\\;U_2,\\;S_2$"),
    ):
        ax.add_patch(Rectangle((x, 0.3), 3.0, 2.8, facecolor=colour, edgecolor="0.4"))
        ax.text(x + 1.5, 2.45, text, ha="center", va="center")
    ax.add_patch(Rectangle((3.2, 0.3), 3.6, 2.8, facecolor="#f4f4f4", edgecolor="0.4", linestyle="--"))
    ax.text(5.0, 2.45, "interface\n$T_c,\\;\\phi,\\;g_n,\\;\\Psi$", ha="center", va="center")
    arrows = (
        ((4.3, 1.6), (2.4, 1.6), RED, "$q_1$", (2.15, 1.6)),
        ((5.7, 1.6), (7.6, 1.6), RED, "$q_2$", (7.85, 1.6)),
        ((2.4, 0.75), (4.3, 0.75), BLUE, "$t_n>0$: tension", None),
        ((6.8, 3.28), (8.6, 3.28), GREEN, "$v$", (8.8, 3.28)),
    )
    for start, end, colour, text, where in arrows:
        ax.add_patch(FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=12, color=colour))
        ax.text(*(where or (4.4, 0.75)), text, color=colour, va="center", ha="left" if where is None else "center")
    return figure


def adhesive() -> Figure:
    """The DNA case on a logarithmic time axis."""
    changes = ["run.spacing=logarithmic", "run.first=1 us"]
    dataset = surfacechem.run("dna-adhesive", changes).dataset
    return plots.figure(dataset, ["T_1", "T_2", "T_c", "phi", "q_1", "q_2"])


def press() -> Figure:
    """Flux through contact spots while a plate is pressed on another."""
    run = computed("press-conductance")
    figure = new(7.2, 2.8)
    left, right = figure.subplots(1, 2, sharex=True)
    left.plot(run.time, run.q_1_spots / 1e3, color=BLUE)
    left.set_xlabel("time [s]")
    left.set_ylabel("heat flux [kW/m$^2$]", color=BLUE)
    pressure = left.twinx()
    pressure.plot(run.time, run.p / 1e3, color="0.6", linestyle="--")
    pressure.set_ylabel("pressure [kPa]", color="0.4")
    figure.get_layout_engine().set(wspace=0.08)
    _temperatures(right, run, "T_1", "T_2")
    return figure


def sudden_contact() -> Figure:
    """Temperatures across two slabs that touch, and that of their contact."""
    run = computed("sudden-contact")
    figure = new(7.2, 2.8)
    left, right = figure.subplots(1, 2)
    for time, shade in ((0.05, "0.7"), (0.5, "0.55"), (2.0, "0.4"), (8.0, "0.2"), (60.0, "0.0")):
        now = run.sel(time=time, method="nearest")
        left.plot(-now.x_1 * 1e3, now.profile_1, color=shade, label=f"{time:g} s")
        left.plot(now.x_2 * 1e3, now.profile_2, color=shade)
    left.set_xlabel("epoxy        distance [mm]        glass")
    left.set_ylabel("temperature [K]")
    left.legend(loc="upper right")
    right.semilogx(run.time[1:], run["T"][1:], color=BLUE)
    right.semilogx(run.time[1:], run["T_exact"][1:], color="0.4", linestyle="--", linewidth=0.8)
    right.set_xlabel("time [s]")
    right.set_ylabel("temperature of the contact [K]")
    return figure


def closing_gap() -> Figure:
    """Conductance of gas and radiation against the gap."""
    run = computed("closing-gas-gap")
    figure = new(4.6, 2.8)
    ax = figure.subplots()
    difference = run.T_2 - run.T_1
    for channel, colour, label in (("film", BLUE, "gas"), ("radiation", RED, "radiation")):
        ax.loglog(run.g_n * 1e6, run[f"q_1_{channel}"] / difference, color=colour, label=label)
    ax.loglog(run.g_n * 1e6, run.k_m / run.g_n, color="0.6", linestyle="--", linewidth=0.8, label="$k_m/g_n$")
    ax.set(xlabel="gap [\N{GREEK SMALL LETTER MU}m]", ylabel="conductance [W/(m$^2$ K)]")
    ax.legend()
    return figure


def oil_film() -> Figure:
    """Temperatures and viscosity of an oil film that heats."""
    run = computed("lubricated-sliding")
    figure = new(7.2, 2.8)
    left, right = figure.subplots(1, 2, sharex=True)
    _temperatures(left, run, "T_1", "T_2", "T_c")
    right.plot(run.time, run.eta_m * 1e3, color=BLUE)
    right.set_xlabel("time [s]")
    right.set_ylabel("viscosity [mPa s]")
    return figure


def _temperatures(ax: Any, run: Any, *names: str) -> None:
    for name, colour in zip(names, (BLUE, RED, GREEN), strict=False):
        ax.plot(run.time, run[name], color=colour, label=f"${name}$")
    ax.set(xlabel="time [s]", ylabel="temperature [K]")
    ax.legend()


def force_spectrum() -> Figure:
    """Rupture forces over six decades of loading rate, and the exact ones."""
    return plots.figure(swept("force-spectroscopy"))


def precision() -> Figure:
    """Run time against error of three solvers."""
    tolerances = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12]
    return surfacechem.precision("exothermic", ["radau", "lsoda", "cvode"], tolerances, repeat=1).figure()


def kept(name: str) -> list[dict[str, str]]:
    """Rows of a benchmark."""
    with (Path(__file__).parents[1] / "benchmarks" / "results" / name).open(newline="") as file:
        return list(csv.DictReader(file))


def speed() -> Figure:
    """Time against achieved error of ours and of other libraries as one who knows them calls them."""
    figure, rows = new(7.2, 6.2), kept("steppers.csv")
    for ax, problem in zip(figure.subplots(2, 2).flat, ("P1", "P2", "P3", "P4"), strict=True):
        for name, style in SHOWN.items():
            own = [row for row in rows if (row["case"], row["solver"]) == (problem, name) and float(row["error"]) < 1]
            errors, times = ([float(row[key]) for row in own] for key in ("error", "microseconds"))
            ax.loglog(errors, times, label=name, markersize=3.5, **style)
        ax.set_title(problem, fontsize=9)
        ax.invert_xaxis()
        ax.set_xlabel("achieved relative error")
        ax.set_ylabel("time [\N{GREEK SMALL LETTER MU}s]")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


OTHERS = ("heyoka", "numbalsoda dop853", "numbalsoda LSODA", "libroadrunner", "diffrax", "scikit-sundae, compiled")
SHOWN: dict[str, dict[str, Any]] = {
    "radau": {"color": BLUE, "marker": "o", "linewidth": 2},
    "dop853": {"color": RED, "marker": "o", "linewidth": 2},
    **{
        name: {"color": plots.COLOURS[2 + k % 4], "marker": "sv"[k // 4], "linewidth": 1}
        for k, name in enumerate(OTHERS)
    },
    "scipy-LSODA": {"color": "0.5", "marker": "s", "linewidth": 1, "linestyle": "--"},
}
"""Solvers of the figure, ours first."""


def growth() -> Figure:
    """Cost against size."""
    figure, rows = new(7.2, 5.0), kept("growth.csv")
    names = list(dict.fromkeys(row["grows"] for row in rows))
    panels = figure.subplots(2, 4, sharey=True)
    colours = dict(zip(dict.fromkeys(row["cost"] for row in rows), plots.COLOURS, strict=False))
    for ax, name in zip(panels.flat, names, strict=False):
        for cost, colour in colours.items():
            found = [row for row in rows if (row["grows"], row["cost"]) == (name, cost)]
            if found:
                sizes, seconds = np.array([(float(row["size"]), float(row["seconds"])) for row in found]).T
                ax.loglog(sizes, seconds, "o-", color=colour, markersize=3.5)
        ax.set_xlabel(name)
    for ax in panels.flat[len(names) :]:
        ax.set_axis_off()
    for ax in panels[:, 0]:
        ax.set_ylabel("time [s]")
    lines = [panels.flat[0].plot([], [], "o-", color=c, markersize=3.5, label=n)[0] for n, c in colours.items()]
    figure.legend(lines, list(colours), loc="outside lower center", ncols=4)
    return figure


GALLERY: dict[str, tuple[list[str], str | None]] = {
    "adhesion-cluster": (["phi"], None),
    "adhesion-cluster-held": (["phi"], None),
    "adiabatic-arrhenius": (["phi", "T"], None),
    "anisotropic-slide": (["v", "v_2"], None),
    "area-stretch": (["T_1", "T_2", "T_c", "phi", "t_coulomb"], None),
    "bond-constant-force": (["phi"], None),
    "bouncing-plate": (["g_n", "T"], None),
    "closing-film": (["T"], "g_n"),
    "closing-gas-gap": (["T_1", "T_2", "q_1_film", "q_1_radiation"], None),
    "cohesive-cooling": (["T"], "g_n"),
    "cohesive-cycles": (["t_n"], "w_n"),
    "cohesive-pull-off": (["t_n"], "w_n"),
    "compliant-debonding": (["t_n"], "g_n"),
    "cooling-to-zero": (["T"], None),
    "coulomb-stop": (["v", "T"], None),
    "debonding": (["t_n", "T"], None),
    "debonding-cooling": (["t_n", "T"], None),
    "dna-adhesive": (["T_1", "T_2", "T_c", "phi"], None),
    "dynamic-pull-off": (["g_n", "E_kinetic_n", "E_spring_n"], None),
    "elastic-bonds-at-a-gap": (["phi", "t_n"], None),
    "endothermic": (["T", "phi"], None),
    "endothermic-kappa-0p1": (["T"], None),
    "endothermic-kappa-0p9": (["T"], None),
    "endothermic-kappa-0p99": (["T"], None),
    "entropic-endothermic": (["T", "phi"], None),
    "epoxy-cure-adiabatic": (["phi", "T"], None),
    "epoxy-cure-isothermal": (["phi"], None),
    "epoxy-cure-thick": (["phi", "T", "T_2", "T_far_1", "T_far_2"], None),
    "exothermic": (["T", "phi"], None),
    "exothermic-kappa-0p1": (["T"], None),
    "exothermic-kappa-1": (["T"], None),
    "exothermic-kappa-2": (["T"], None),
    "exponential-affinity": (["phi"], None),
    "friction-ignited-bonding": (["phi"], "T"),
    "friction-with-loss": (["T", "D_coulomb"], None),
    "generalised-bonding": (["T", "phi"], None),
    "generalised-bonding-sliding": (["T", "phi"], None),
    "hot-plate-bonds": (["g_n", "T_1", "T_2", "T_c", "phi"], None),
    "lithium-charging": (["V_electron", "i_electron", "j_electron"], None),
    "lubricated-sliding": (["T_1", "T_2", "T_c", "t_film_shear"], None),
    "no-medium": (["T_1", "T_2"], None),
    "one-sided-contact": (["T_1", "T_2", "phi"], None),
    "pair-exchange": (["T_1", "T_2"], None),
    "press-conductance": (["T_1", "T_2", "p", "q_1"], None),
    "press-hold-pull": (["theta_bond_s", "t_n"], None),
    "pulled-at-an-angle": (["u_t2"], "u_t"),
    "rate-and-state-slip-law": (["t_rate_and_state_slip", "theta"], None),
    "rate-and-state-stick-slip": (["t_t", "u_t", "theta"], None),
    "rate-and-state-velocity-steps": (["t_rate_and_state_aging", "theta"], None),
    "reservoir-exchange": (["T_1", "T_2"], None),
    "shared-load-rupture": (["phi"], None),
    "sliding-dry": (["T"], None),
    "sliding-viscous": (["T"], None),
    "slow-passage": (["g_n"], None),
    "snap-in": (["t_n"], "g_n"),
    "squeeze-film": (["g_n", "T"], None),
    "stick-slip": (["t_t", "v", "T"], None),
    "stick-slip-debonding": (["t_t", "phi", "u_t"], None),
    "stick-slip-rebonding": (["t_t", "phi"], None),
    "sticky-sphere": (["t_n", "q_12"], "g_n"),
    "sudden-contact": (["T", "q_1"], None),
    "thermal-press": (["g_n", "T_1", "T_2"], None),
    "three-temperatures": (["T_1", "T_2", "T_c"], None),
    "three-temperatures-no-capacity": (["T_1", "T_2", "T_c"], None),
    "tribofilm-growth": (["d_m", "T_c"], None),
    "two-way-linear": (["phi"], None),
    "unequal-sites": (["phi"], None),
    "van-der-waals-sphere": (["t_n"], "g_n"),
    "viscous-heating": (["T", "t_viscous"], None),
    "weakening-friction": (["T", "D_coulomb"], None),
}
"""Variables that are plotted of a case, and the abscissa if not time; of others the usual panels."""

SWEPT = (
    *("biotin-streptavidin", "bond-lifetimes", "catch-bond", "force-spectroscopy"),
    *("l-selectin-tether", "vinculin-catch-bond"),
)
"""Cases of the gallery whose sweep is plotted."""


def gallery(name: str) -> Figure:
    """A case of the gallery."""
    if name in SWEPT:
        return plots.figure(swept(name))
    variables, against = GALLERY.get(name, (None, None))
    return plots.figure(computed(name), variables, against)


def surfaces(name: str) -> Figure:
    """Profiles, tractions and force of a case with curved surfaces."""
    return plots.figure(computed(name), ["traction"])


def gas_network() -> Figure:
    """The figure of the notebook."""
    return execution.executed(str(Path(__file__).parent / "notebooks" / "gas_network.py"))[1]["figure"]


def rooms() -> Figure:
    """Figure of how many modules of each room import each other room, in the order of the contracts from the top."""
    package = Path(surfacechem.__file__).parent
    contracts = tomllib.loads((package.parent / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    names = [room for floor in contracts["contracts"][0]["layers"] for room in floor.split(" | ")]
    modules = {room: [*(package / room).rglob("*.py"), *package.glob(f"{room}.py")] for room in names}
    table = np.zeros((len(names), len(names)))
    for i, room in enumerate(names):
        texts = [file.read_text(encoding="utf-8") for file in modules[room]]
        for j, other in enumerate(names):
            imports = re.compile(rf"^ *(from|import) surfacechem(\.| import .*\b){other}\b", re.MULTILINE)
            table[i, j] = 0 if i == j else sum(bool(imports.search(text)) for text in texts)
    figure = new(6.8, 5.6)
    ax = figure.subplots()
    ax.imshow(np.log1p(table), cmap="Blues", vmax=1.6 * np.log1p(table.max()))
    for i, j in zip(*np.nonzero(table), strict=True):
        ax.text(j, i, f"{table[i, j]:.0f}", ha="center", va="center", fontsize=7)
    for i in range(len(names)):
        ax.add_patch(Rectangle((i - 0.5, i - 0.5), 1, 1, color="0.75"))
    ax.set_xticks(range(len(names)), names, rotation=60, ha="left", rotation_mode="anchor")
    ax.set_yticks(range(len(names)), [f"{room} ({len(modules[room])})" for room in names])
    ax.grid(visible=False)
    ax.tick_params(length=0, top=False, bottom=False, labeltop=True, labelbottom=False, labelsize=8)
    ax.set_ylabel("room (its modules) that imports ...")
    ax.set_xlabel("... this room", labelpad=6)
    ax.xaxis.set_label_position("top")
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {
    **{f"gallery-{name}.svg": partial(gallery, name) for name in case.names()},
    "gallery-gas-network.svg": gas_network,
    "accuracy.svg": accuracy,
    "precision.svg": precision,
    "speed.svg": speed,
    "growth.svg": growth,
    "signs.svg": signs,
    "press.svg": press,
    "rooms.svg": rooms,
    "sudden-contact.svg": sudden_contact,
    "closing-gap.svg": closing_gap,
    "oil-film.svg": oil_film,
    "dna-adhesive.svg": adhesive,
    "force-spectrum.svg": force_spectrum,
    "surfaces-attraction.svg": partial(surfaces, "van-der-waals-sphere"),
    "surfaces-contact.svg": partial(surfaces, "sticky-sphere"),
}

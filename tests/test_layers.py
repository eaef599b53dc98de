"""Imports go down the floors of the package, inside functions too, and never in a circle."""

import ast
from collections.abc import Iterator
from fnmatch import fnmatchcase
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import surfacechem.data

# A floor sees itself and the floors before it. "name.*" is a folder: the package and all modules in it.
FLOORS = {
    "words": [
        "quantities",
        "expressions",
        "units",
        "document",
        "overrides",
        "errors",
        "waiting",
        "data",
        "fits",
        "grids",
        "springs",
    ],
    "contracts": ["law", "terms", "substances", "scene"],
    "core": [
        "balances",
        "conductors",
        "variables",
        "refit",
        "holding",
        "transitions",
        "system",
        "validity",
        "assembly.*",
        "compile",
        "preparing",
        "kernelcache",
        "objectcode",
    ],
    "time": [
        "solvers.*",
        "marching",
        "damped",
        "domains",
        "equilibria",
        "jumps",
        "stretches",
        "watching",
        "stalls",
        "rebounds",
        "events",
        "pacing",
        "pieces",
        "passing",
        "starting",
        "ends",
        "integrate",
    ],
    "results": ["accuracy", "netcdf", "profiles", "solution", "audit", "extremes", "event_table", "detailedbalance"],
    "studies": [
        "references.*",
        "achieved",
        "choice",
        "spectrum",
        "onebyone",
        "sweeps",
        "sweep_runs",
        "sweep_dataset",
        "sweep_plots",
        "precision",
        "spatial",
        "lumping",
        "check",
        "listing",
        "plots",
        "panels",
        "marks",
        "printing",
        "report",
        "studyreport",
        "workprecision.*",
        "ratecurves",
        "cycles",
        "mechanismsheet",
        "rateplots",
    ],
    "doors": [
        "case.*",
        "schema",
        "sweeping",
        "simulation",
        "stability.*",
        "extension",
        "reactor.*",
        "rerun",
        "guard",
        "commands",
        "comparing",
        "cli",
        "cli_precision",
        "cli_stability",
        "__init__",
        "__main__",
    ],
}
# The concrete laws stand beside the tower: what they see, and who sees them.
WING = ["laws.*", "mechanism.*", "media.*"]
WING_SEES = ["words", "contracts"]
SEES_WING = ["studies", "doors"]

PACKAGE = Path(surfacechem.data.__file__).parent
SEES = {floor: {*list(FLOORS)[: i + 1], *(["wing"] if floor in SEES_WING else [])} for i, floor in enumerate(FLOORS)}
SEES["wing"] = {"wing", *WING_SEES}


def module(path: Path) -> str:
    """`laws.friction`, `laws` for a package, `__init__` for the whole."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if len(parts) > 1 and parts[-1] == "__init__" else parts)


FILES = {module(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def floor(name: str) -> str | None:
    for title, patterns in {**FLOORS, "wing": WING}.items():
        if any(fnmatchcase(name, p) or name == p.removesuffix(".*") for p in patterns):
            return title
    return None


def imports(source: str, package: str, known: set[str]) -> Iterator[str]:
    """The modules of surfacechem that a source names; `package` is the folder it lies in, e.g. `surfacechem.laws`."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Import(names=names):
                targets = [alias.name for alias in names]
            case ast.ImportFrom(module=origin, names=names, level=level):
                base = package.split(".")[: len(package.split(".")) - level + 1] if level else []
                stem = ".".join([*base, *([origin] if origin else [])])
                targets = [f"{stem}.{alias.name}" for alias in names]
            case ast.Call(
                func=ast.Attribute(attr="import_module") | ast.Name(id="import_module"),
                args=[ast.Constant(value=str(name)), *_],
            ):
                targets = [name if not name.startswith(".") else package + name]
            case _:
                continue
        for target in targets:
            if target.split(".")[0] == "surfacechem":
                yield longest_known(target.split(".")[1:], known)


def longest_known(parts: list[str], known: set[str]) -> str:
    """The module in `terms.Potential`; a name of the whole package is one of its `__init__`."""
    while parts and ".".join(parts) not in known:
        parts = parts[:-1]
    return ".".join(parts) or "__init__"


def package_of(path: Path) -> str:
    return ".".join(["surfacechem", *path.parent.relative_to(PACKAGE).parts])


GRAPH = {
    name: set(imports(path.read_text(encoding="utf-8"), package_of(path), set(FILES))) - {name}
    for name, path in FILES.items()
}


@pytest.mark.parametrize("name", FILES)
def test_imports_go_down(name):
    here = floor(name)
    assert here, f"{name} is on no floor: add it to FLOORS"
    up = {other: floor(other) for other in GRAPH[name] if floor(other) not in SEES[here]}
    assert not up, f"{name} ({here}) must not import {up}"


def test_no_import_goes_in_a_circle():
    try:
        TopologicalSorter(GRAPH).prepare()
    except CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import numpy", []),
        ("import surfacechem", ["__init__"]),
        ("import surfacechem.terms as t", ["terms"]),
        ("from surfacechem import terms, Scene", ["terms", "__init__"]),
        ("from surfacechem.terms import Potential", ["terms"]),
        ("from ..terms import Potential", ["terms"]),
        ("from . import friction", ["laws.friction"]),
        ("from .friction import Coulomb", ["laws.friction"]),
        ("def f():\n    from surfacechem.laws import friction", ["laws.friction"]),
        ("import_module('surfacechem.terms')", ["terms"]),
        ("importlib.import_module('.friction', __package__)", ["laws.friction"]),
    ],
)
def test_every_way_to_import_is_seen(source, found):
    assert list(imports(source, "surfacechem.laws", {"__init__", "terms", "laws", "laws.friction"})) == found


def test_the_core_knows_no_law():
    assert "wing" not in SEES["core"]
    assert floor("laws.friction") == floor("laws") == "wing"
    assert floor("solvers.radau") == "time"

"""The structure of the package in figures: sizes, shapes of functions, names, thresholds, cycles, and where they are.

    python tests/house.py                    every figure beside its bound
    python tests/house.py where FIGURE       where a figure is from, the largest part first
    python tests/house.py --tighten          write the figures that are better than their bounds

house.toml has the bounds, and test_house.py fails where a figure is worse. ``--tighten`` never loosens one: where the
package has to grow, its bound is changed by hand, in the commit that grows it and with the reason in its message. A
figure is a hint where to look; moving lines about to satisfy it helps nobody.
"""

import ast
import re
import statistics
import sys
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache, cached_property
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "surfacechem"
BOUNDS = Path(__file__).with_suffix(".toml")

MORE_IS_BETTER = ("comment lines per 100 code lines", "function body, median")
"""Figures that must not fall; all others must not rise. A body of a line or two is a name that its reader has to look
up."""

SMALL = 1e-2
"""Positive numbers below this are thresholds, as a rule."""

DATA = {"laws", "references", "mechanism", "regimes"}
"""Folders in which small numbers are data of materials and cases."""

TABLES = {"tolerances", "tables", "quantities", "units"}
"""Modules of small numbers that stand together: tolerances, coefficients of methods, and units."""

PROSE = re.compile(r"#\s*(?!type:|noqa|pragma|fmt:)")

STRING = re.compile(r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*\"""")

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass
class Figure:
    """A number, and what it is made of: a place and its part."""

    value: float
    places: list[tuple[str, float]] = field(default_factory=list)

    @classmethod
    def total(cls, places: list[tuple[str, float]]) -> "Figure":
        return cls(sum(part for _, part in places), places)

    @classmethod
    def most(cls, places: list[tuple[str, float]]) -> "Figure":
        return cls(max((part for _, part in places), default=0), places)

    def worst(self, count: int | None = None) -> list[tuple[str, float]]:
        """The places with the largest parts first; those without any are left out."""
        return sorted(((where, part) for where, part in self.places if part), key=lambda item: -item[1])[:count]


class Module:
    """A source file: its text, its syntax and its lines."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.text = path.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @cached_property
    def nodes(self) -> list[ast.AST]:
        return list(ast.walk(self.tree))

    @property
    def place(self) -> str:
        return self.path.relative_to(ROOT).as_posix()

    def at(self, node: ast.stmt | ast.expr, name: str = "") -> str:
        return f"{self.place}:{node.lineno} {name}".rstrip()

    @cached_property
    def lines(self) -> dict[int, str]:
        """Lines by their numbers, without those of strings that go over several lines."""
        return {n: line for n, line in enumerate(self.text.splitlines(), 1) if n not in self.long_strings}

    @cached_property
    def code(self) -> set[int]:
        """Lines with code; docstrings are none."""
        told = {n for n, line in self.lines.items() if line.strip() and not line.lstrip().startswith("#")}
        return (told | self.long_strings) - self.docstrings

    @cached_property
    def long_strings(self) -> set[int]:
        strings = (n for n in self.nodes if isinstance(n, ast.JoinedStr) or _is_text(n))
        return {line for n in strings if n.end_lineno != n.lineno for line in _lines(n)}

    @cached_property
    def docstrings(self) -> set[int]:
        """Lines of strings that stand by themselves."""
        alone = (n.value for n in self.nodes if isinstance(n, ast.Expr) and _is_text(n.value))
        return {line for node in alone for line in _lines(node)}

    @property
    def comments(self) -> int:
        """Comments; what is within the quotation marks of a line is none."""
        rests = (STRING.sub("", line) for line in self.lines.values() if "#" in line)
        return sum(bool(PROSE.search(rest)) for rest in rests)

    @cached_property
    def functions(self) -> list[Function]:
        return [node for node in self.nodes if isinstance(node, Function)]

    def body(self, function: Function) -> int:
        """Lines of code in the body of a function."""
        return len(self.code & set(range(function.body[0].lineno, (function.end_lineno or 0) + 1)))

    @property
    def small_numbers(self) -> list[ast.Constant]:
        if DATA & set(self.path.relative_to(PACKAGE).parts) or self.path.stem in TABLES:
            return []
        numbers = (n for n in self.nodes if isinstance(n, ast.Constant) and isinstance(n.value, float))
        return [node for node in numbers if 0 < abs(node.value) < SMALL]


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _lines(node: ast.AST) -> range:
    return range(node.lineno, node.end_lineno + 1)


def modules(folder: Path) -> list[Module]:
    return [Module(path) for path in sorted(folder.rglob("*.py"))]


def complexity(function: Function) -> int:
    """Cyclomatic complexity: the number of ways through a function."""
    branches = (ast.If, ast.For, ast.While, ast.IfExp, ast.ExceptHandler, ast.Assert, ast.match_case)
    count = 1
    for part in ast.walk(function):
        count += isinstance(part, branches)
        count += 1 + len(part.ifs) if isinstance(part, ast.comprehension) else 0
        count += len(part.values) - 1 if isinstance(part, ast.BoolOp) else 0
    return count


def parameters(function: Function) -> int:
    """Parameters of a function, without self."""
    a = function.args
    names = [item.arg for item in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def forms_row(node: ast.AST) -> bool:
    """Whether a row of the equations is written or taken away: ``build.rows[...] = ...``, ``build.rows.pop(...)``."""
    if isinstance(node, ast.Assign | ast.AugAssign | ast.Delete):
        targets = [node.target] if isinstance(node, ast.AugAssign) else node.targets
        return any(isinstance(t, ast.Subscript) and _attribute(t.value) == "rows" for t in targets)
    called = node.func if isinstance(node, ast.Call) else None
    return isinstance(called, ast.Attribute) and called.attr in ("pop", "update") and _attribute(called.value) == "rows"


def asks_by_string(node: ast.AST) -> bool:
    """Whether something is told by the text of its name or unit, or by an attribute that it happens to have."""
    if isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        texts = any(isinstance(n, ast.Constant) and isinstance(n.value, str) for side in sides for n in ast.walk(side))
        return texts and any(_attribute(side) in ("name", "unit") for side in sides)
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Name):
        return node.func.id == "hasattr"
    searched = isinstance(node.func, ast.Attribute) and node.func.attr in ("startswith", "endswith")
    return searched and _attribute(node.func.value) in ("name", "unit")


def _attribute(node: ast.AST) -> str:
    return node.attr if isinstance(node, ast.Attribute) else ""


def cycles(package: list[Module]) -> list[list[str]]:
    """Circles of imports at the top of modules, each once."""
    names = {".".join(m.path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): m for m in package}
    graph = {name: set(_imported(name, module, names)) - {name} for name, module in names.items()}
    found: list[list[str]] = []
    while True:
        try:
            TopologicalSorter(graph).prepare()
            return found
        except CycleError as error:
            circle = error.args[1]
            found.append(circle)
            graph[circle[1]].discard(circle[0])


def _imported(name: str, module: Module, names: dict[str, Module]) -> Iterator[str]:
    """Modules that a module imports; a package that it is in is none."""
    inside = name.split(".") if module.path.name == "__init__.py" else name.split(".")[:-1]
    for node in module.tree.body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in names)
        if isinstance(node, ast.ImportFrom):
            base = inside[: len(inside) - node.level + 1] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            targets = (f"{stem}.{a.name}" if f"{stem}.{a.name}" in names else stem for a in node.names)
            yield from (target for target in targets if target in names and not name.startswith(f"{target}."))


def repeated(names: Iterator[tuple[str, str]]) -> Figure:
    """Names that mean several things; ``names`` are pairs of a name and its place."""
    places = defaultdict(list)
    for name, place in names:
        places[name].append(place)
    several = {name: where for name, where in places.items() if len(where) > 1}
    return Figure(len(several), [(f"{name}: {', '.join(where)}", len(where)) for name, where in several.items()])


@cache
def figures() -> dict[str, Figure]:
    """All figures by name."""
    package = modules(PACKAGE)
    functions = [(m, f) for m in package for f in m.functions]
    bodies = sorted(m.body(f) for m, f in functions)
    words = Counter(word for m in package for word in re.findall(r"\b_\w+", m.text))
    private = [(m, f) for m, f in functions if f.name.startswith("_") and not f.name.startswith("__")]
    once = [(m.at(f, f.name), 1.0) for m, f in private if words[f.name] == 2]
    folders = Counter(m.path.parent for m in package if "references" not in m.path.parts)
    lines = [(m.place, float(len(m.code))) for m in package]
    comments = [(m.place, float(m.comments)) for m in package]
    circles = [(" -> ".join(circle), 1.0) for circle in cycles(package)]

    def nodes(told: Callable[[ast.AST], bool], outside: str = "") -> list[tuple[str, float]]:
        return [(m.at(n), 1.0) for m in package if m.path.stem != outside for n in m.nodes if told(n)]

    return {
        "files at the top of the package": Figure(folders[PACKAGE]),
        "files": Figure(len(package)),
        "files in one folder, references aside": Figure.most(
            [(f.relative_to(ROOT).as_posix(), float(n)) for f, n in folders.items() if f != PACKAGE]
        ),
        "code lines": Figure.total(lines),
        "comment lines per 100 code lines": Figure(
            round(100 * Figure.total(comments).value / Figure.total(lines).value, 2), comments
        ),
        "functions": Figure(len(functions)),
        "function body, median": Figure(statistics.median(bodies)),
        "function body, 90th percentile": Figure(bodies[int(0.9 * len(bodies))]),
        "function body, longest": Figure.most([(m.at(f, f.name), float(m.body(f))) for m, f in functions]),
        "cyclomatic complexity, highest": Figure.most([(m.at(f, f.name), complexity(f)) for m, f in functions]),
        "parameters, most": Figure.most([(m.at(f, f.name), parameters(f)) for m, f in functions]),
        "private functions used once, per 100 functions": Figure(round(100 * len(once) / len(functions), 1), once),
        "small numbers outside laws and tables": Figure.total(
            [(m.at(n, repr(n.value)), 1.0) for m in package for n in m.small_numbers]
        ),
        "rows formed outside balances": Figure.total(nodes(forms_row, outside="balances")),
        "names and units asked for by string": Figure.total(nodes(asks_by_string)),
        "file names that occur more than once": repeated(
            (m.path.stem, m.place) for m in package if not m.path.stem.startswith("__")
        ),
        "class names that occur more than once": repeated(
            (n.name, m.place)
            for m in package
            for n in m.nodes
            if isinstance(n, ast.ClassDef) and not n.name.startswith("_")
        ),
        "import cycles": Figure.total(circles),
        "test lines": Figure.total([(m.place, float(m.text.count("\n"))) for m in modules(ROOT / "tests")]),
    }


def bounds() -> dict[str, float]:
    return tomllib.loads(BOUNDS.read_text(encoding="utf-8"))


def worse(title: str, value: float, bound: float) -> bool:
    return value < bound if title in MORE_IS_BETTER else value > bound


def tightened(old: dict[str, float]) -> dict[str, float]:
    """The bounds, those of figures that are better replaced; a figure without a bound gets its own value."""
    now = {title: figure.value for title, figure in figures().items()}
    return {
        title: old[title] if title in old and worse(title, value, old[title]) else value for title, value in now.items()
    }


def tighten() -> None:
    found = tightened(bounds() if BOUNDS.exists() else {})
    text = "".join(f'"{title}" = {value:g}\n' for title, value in found.items())
    BOUNDS.write_text(f"# Bounds of tests/house.py: none may become worse.\n{text}", encoding="utf-8")


def table() -> str:
    """Every figure beside its bound."""
    known = bounds()
    rows = [(title, figure.value, known.get(title, figure.value)) for title, figure in figures().items()]
    body = "".join(
        f"{title:50}{value:>9g}{bound:>9g}{'  worse' if worse(title, value, bound) else ''}\n"
        for title, value, bound in rows
    )
    return f"{'':50}{'now':>9}{'bound':>9}\n{body}"


def main(arguments: list[str]) -> None:
    match arguments:
        case []:
            print(table(), end="")
        case ["--tighten"]:
            tighten()
        case ["where", title]:
            print("".join(f"{part:9g}  {place}\n" for place, part in figures()[title].worst()), end="")
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])

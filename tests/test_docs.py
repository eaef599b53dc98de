"""What the documentation shows is true: its Python runs, its commands print what it says, its cases load."""

import doctest
import importlib
import inspect
import re
import shlex
import warnings
from dataclasses import dataclass
from pathlib import Path

import griffe
import pytest
from typer.testing import CliRunner

import surfacechem
from surfacechem.cli import app
from surfacechem.documents.document import parse
from surfacechem.format import names
from surfacechem.solve.radau import stepper

pytestmark = pytest.mark.around

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
FENCE = re.compile(
    r"(?:^<!-- part of: (?P<base>\S+) -->\n)?"
    r"^```(?P<language>\w+)(?: title=\"(?P<title>[^\"]+)\")?\n(?P<body>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
NUMBER = re.compile(r"-?\b\d+(\.\d+)?(e[-+]?\d+)?\b( (us|ms|s)\b)?")

each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    body: str
    title: str | None = None
    base: str | None = None
    """Name of the shipped case of which the block shows a part."""


def blocks(page: Path) -> list[Block]:
    return [Block(**match.groupdict()) for match in FENCE.finditer(page.read_text(encoding="utf-8"))]


def masked(text: str) -> str:
    """Numbers and times vary from machine to machine; words do not."""
    return NUMBER.sub("#", text)


def check(shown: str, got: str, command: str) -> None:
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    assert doctest.OutputChecker().check_output(masked(shown), masked(got), flags), f"{command}\n{got}"


def surfacechem_command(arguments: str) -> tuple[int, str]:
    """Exit code and everything that a command prints; in this process, which has all libraries loaded."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as for a user, to whom those of libraries are nothing new
        done = CliRunner().invoke(app, shlex.split(arguments), prog_name="surfacechem")
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


def made(folder: Path) -> str:
    """What the recipe of `make run` prints through this package."""
    recipe = (ROOT / "Makefile").read_text().partition("\nrun:")[2].partition("\n\n")[0]
    (folder / "results").mkdir()
    commands = re.findall(r"^\t\$\(BIN\)/surfacechem (.*)$", recipe, re.MULTILINE)
    return "".join(surfacechem_command(command)[1] for command in commands)


def run_session(body: str, folder: Path) -> None:
    """Run the `surfacechem` commands of a console block and compare what they print with what is shown."""
    code = 0
    for entry in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
        command, _, shown = entry.partition("\n")
        if command.startswith("surfacechem "):
            code, got = surfacechem_command(command.removeprefix("surfacechem "))
            assert code == 0 or shown.strip() not in ("", "..."), f"{command}\n{got}"
            if shown.strip() or got.strip():
                check(shown, got, command)
        elif command == "echo $?":
            assert int(shown) == code
        elif command == "make run" and shown.strip():
            lines = masked(made(folder)).splitlines()
            assert all(line in lines for line in masked(shown).splitlines()), lines


def run_python(block: Block, namespace: dict, page: Path) -> None:
    exec(compile(block.body, f"{page.name}: {block.title or 'python'}", "exec", dont_inherit=True), namespace)
    for name, value in list(namespace.items()):
        if isinstance(value, type) and value.__module__ == namespace["__name__"] and value.__doc__:
            example = doctest.DocTestParser().get_doctest(value.__doc__, dict(namespace), name, page.name, 0)
            assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example).failed == 0


@each_page
def test_page_runs_from_top_to_bottom(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stepper.LOOP.load()
    namespace: dict = {"__name__": page.stem}
    for block in blocks(page):
        if block.language == "yaml" and block.title:
            (tmp_path / block.title).write_text(block.body, encoding="utf-8")
        elif block.language == "console":
            run_session(block.body, tmp_path)
        elif block.language == "python":
            run_python(block, namespace, page)


@each_page
def test_parts_of_cases_are_valid(page):
    for block in blocks(page):
        if block.base:
            surfacechem.load(block.base, parse(block.body).plain()).system  # noqa: B018


def test_the_gallery_shows_every_case():
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for name in names():
        assert f"](cases.md#{name})" in page
        assert f"](images/gallery-{name}.svg)" in page


def test_every_law_has_its_place_on_a_page(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    hooks = importlib.import_module("hooks")
    for family in hooks.families():
        assert f"]({family}.md#" in hooks.laws_index()
        assert "| parameter | " in hooks.family_page(family)


def test_pages_tell_of_every_mode_and_of_what_a_check_of_laws_ends_with():
    dataset, commands = ((ROOT / "docs" / f"{name}.md").read_text() for name in ("dataset", "command-line"))
    sources = "".join(path.read_text() for path in (ROOT / "surfacechem" / "model").rglob("*.py"))
    for name in ("H_events", "H_events_entropy", *re.findall(r'\bMode\("(\w+)"', sources)):
        assert f"`{name}`" in dataset, name
    assert "`laws --check`" in commands
    assert "laws --check" in CliRunner().invoke(app, ["laws", "--help"]).stdout


def test_links_of_the_readme_exist():
    links = re.findall(r"\]\(([^)#:]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert all((ROOT / link).exists() for link in links), links


SHOWN = re.compile(r"^::: (?P<path>[\w.]+)(?:\n    options: {(?:members: \[(?P<members>[^]]*)])?)?", re.MULTILINE)
"""What the pages show of the Python API, and which members of a class."""

NEVER_RAISE = {"Simulation.of", "Study.figure", "Model.evaluate", "InterfaceReactor.record", "Run.second"}

NUMBERS = re.compile(r"\b(float|Array|NDArray)\b")
"""Annotations of what has a unit, which its description tells in brackets or words."""
UNIT = re.compile(r"\[[^\]]+\]|\bSI\b|[Rr]elative|\bunit\b|\bm\^2\b|^Number of ")


def shown_functions():
    """Every function and method that the pages document, by name."""
    for page in PAGES:
        for match in SHOWN.finditer(page.read_text(encoding="utf-8")):
            module, _, name = match["path"].rpartition(".")
            found = getattr(importlib.import_module(module), name)
            if not inspect.isclass(found):
                yield name, found
                continue
            every = [each for each in vars(found) if not each.startswith("_")]
            members = every if match["members"] is None else filter(None, match["members"].split(", "))
            methods = ((each, getattr(found, each, None)) for each in members)
            yield from (
                (f"{name}.{each}", method)
                for each, method in methods
                if inspect.isfunction(method) or inspect.ismethod(method)
            )


@pytest.mark.parametrize(("name", "function"), [pytest.param(*pair, id=pair[0]) for pair in shown_functions()])
def test_what_the_pages_show_names_parameters_returns_and_errors(name, function):
    signature = inspect.signature(function)
    sections = griffe.Docstring(inspect.getdoc(function)).parse("numpy", warnings=False)
    told = {section.kind.value: section.value for section in sections}
    described = {item.name: item.description for item in told.get("parameters", [])}
    wanted = [f"*{x.name}" if x.kind is x.VAR_POSITIONAL else x.name for x in signature.parameters.values()]
    assert described.keys() == set(wanted) - {"self", "cls"}
    assert all(described.values())
    parameters = {name: signature.parameters[name.lstrip("*")] for name in described}
    numbers = [name for name in described if NUMBERS.search(str(parameters[name].annotation))]
    assert [name for name in numbers if not UNIT.search(described[name])] == []
    assert ("returns" in told) is (signature.return_annotation not in ("None", None))
    assert ("raises" in told) is (name not in NEVER_RAISE)

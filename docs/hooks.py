"""Pages and tables that are made from the code when the documentation is built, so that they cannot fall behind it.

A page asks for a table with a comment: ``<!-- made: variables area-stretch -->``.
"""

import csv
import dataclasses
import gc
import inspect
import math
import re
from collections.abc import Callable, Iterator
from functools import cache
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

import surfacechem
from surfacechem import documents as data
from surfacechem import format as cases
from surfacechem import plots, references
from surfacechem.contracts.terms import Law, Potential, Spec, reads
from surfacechem.laws import FAMILIES, laws, module
from surfacechem.quantities import VARIABLES
from surfacechem.runs import listing
from surfacechem.studies.regimes import regimes
from surfacechem.studies.stability import stability

PLACES = {
    "capacity": "`bodies.NAME.capacity`, with its parameters beside it",
    "potential": "interface.potential",
    "bonding": "interface.bonding",
    "friction": "interface.friction",
    "heat": "heat",
    "limit": "interface.limits",
    "growth": "interface.medium.growth",
    "property": "`interface.medium`, under the name of the property",
    "loading": "loading.NAME",
    "shape": "`surface.bodies`, under the name of a body",
    "pair": "surface.pair",
    "factor": "the list `times` of a parameter that varies",
}
"""Place of the laws of a contract in a case file."""

LAWS = """\
A law is one class in one file: its name in a case file, its parameters with units and ranges, its formula and its
source. These pages are made from the classes when the documentation is built. `surfacechem laws` prints the same,
`surfacechem laws coulomb` one of them.

What a potential gives (traction, entropy, chemical potential, heat of reaction, capacity) is differentiated from its
formula; see the [theory](../theory.md). How to [add a law](../adding-a-law.md)."""


# -- hooks ------------------------------------------------------------------------------------------------------------


def on_startup(**_: Any) -> None:
    """Collect garbage seldom: at the usual rate all datasets and pages are looked through again and again."""
    gc.set_threshold(100_000, 20, 50)


def on_config(config: Any) -> Any:
    """Put the generated pages of the laws into the navigation."""
    for section in config.nav:
        for entry in (item for items in section.values() for item in items if "Laws" in item):
            entry["Laws"] = ["laws/index.md", *(f"laws/{family}.md" for family in families())]
    config.copyright = f"surfacechem {version('surfacechem')}"
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages."""
    pages = {"laws/index.md": laws_index()}
    pages |= {f"laws/{family}.md": family_page(family) for family in families()}
    for path, content in pages.items():
        files.append(File.generated(config, path, content=content))
    buffer = BytesIO()
    plots.save(stability_study().figure(), buffer, "svg")
    files.append(File.generated(config, "images/stability.svg", content=buffer.getvalue()))
    for name in ("paper", "published"):
        for picture in drawn(name):
            buffer = BytesIO()
            plots.save(picture.draw(), buffer, "svg")
            path = f"images/list-{name}-{picture.section.name}.svg"
            files.append(File.generated(config, path, content=buffer.getvalue()))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fill in the tables that the page asks for."""
    return re.sub(r"<!-- made: (\w+) ?(.*?) *-->", lambda m: MAKERS[m[1]](*m[2].split()), markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Docstrings that mkdocstrings has rendered as Markdown: roles and formulas of reStructuredText."""
    html = re.sub(r":(?:class|func|meth|attr|mod):<code>~?([\w.]+)</code>", _role, html)
    html = re.sub(r":math:<code>(.*?)</code>", r'<span class="arithmatex">\\(\1\\)</span>', html, flags=re.DOTALL)
    return re.sub(r"<p>\.\. math:: ?(.*?)</p>", r'<div class="arithmatex">\\[\1\\]</div>', html, flags=re.DOTALL)


def _role(match: re.Match[str]) -> str:
    return f"<code>{match[1].rpartition('.')[2]}</code>"


# -- docstrings -------------------------------------------------------------------------------------------------------


def markdown(docstring: str) -> str:
    """A docstring of this package as Markdown: formulas, roles and worked numbers."""
    text = re.sub(
        r"^\.\. math::((?:.*\n)(?:[ \t]+.*\n|[ \t]*\n(?=[ \t]))*)", _formula, docstring + "\n", flags=re.MULTILINE
    )
    text = re.sub(r":math:`([^`]*)`", r"$\1$", text)
    text = re.sub(r":class:`~?(?:\w+\.)*(\w+)`", r"`\1`", text)
    text = re.sub(r"(^>>> (?:.+\n)+)", r"```python\n\1```\n", text, flags=re.MULTILINE)
    return re.sub(r"(^|\s)Source: ", r"\1*Source:* ", text).strip()


def _formula(match: re.Match[str]) -> str:
    lines = "\n".join(line.strip() for line in match[1].strip().splitlines())
    rows = lines.replace("\\\\\n", "\\\\\n&")
    body = f"\\begin{{aligned}}\n&{rows}\n\\end{{aligned}}" if rows != lines else lines
    return f"\n$$\n{body}\n$$\n\n"


def first_line(thing: Any) -> str:
    """The first sentence of a docstring."""
    return " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())


def inline(thing: Any) -> str:
    """The first sentence as Markdown."""
    return markdown(first_line(thing))


# -- laws -------------------------------------------------------------------------------------------------------------


def families() -> list[str]:
    """Modules of laws, in the order of the contracts."""
    return list(dict.fromkeys(family for modules in FAMILIES.values() for family in modules))


def _title(family: str) -> str:
    return (module(family).__doc__ or family).split("\n")[0].partition(":")[0].rstrip(".")


def _members(family: str) -> Iterator[tuple[type[Law], type[Law]]]:
    home = module(family).__name__
    for contract in FAMILIES:
        yield from ((contract, law) for law in laws(contract).values() if law.__module__ == home)


def laws_index() -> str:
    """All laws on one page."""
    lines = ["# Laws", LAWS]
    for family in families():
        rows = [(f"[`{law.name()}`]({family}.md#{law.name()})", inline(law)) for _, law in _members(family)]
        lines += [f"## {_title(family)}", table(("law", "what it is"), rows)]
    return "\n\n".join(lines)


def family_page(family: str) -> str:
    """All about the laws of one module."""
    parts = [f"# {_title(family)}"]
    members = list(_members(family))
    for contract in dict.fromkeys(contract for contract, _ in members):
        where = PLACES.get(contract.contract, contract.contract)
        parts += [f"{inline(contract)} In a case file: {where if '`' in where else f'`{where}`'}."]
    parts += [law_section(law) for _, law in members]
    return "\n\n".join(parts)


def law_section(law: type[Law]) -> str:
    """One law: formula, parameters, what it reads, worked number."""
    parts = [f"## `{law.name()}` {{ #{law.name()} }}", markdown(inspect.getdoc(law) or "")]
    rows = [_parameter_row(law, name, spec) for name, spec in law.specs()]
    rows += [(f"`{name}`", "", text, "", _default(law, name)) for name, text in law.options()]
    parts += [table(("parameter", "unit", "meaning", "range", "if not given"), rows)] if rows else []
    meanings = {name: quantity.long_name for name, quantity in VARIABLES.items()} | {"N_c": "nominal site density"}
    found = [f"{meanings[name]} `{name}`" for name in reads(getattr(law, law.formula)) if name in meanings]
    parts += [f"Reads: {', '.join(found)}."] if found and law.contract != "shape" else []  # u and v are its own
    parts += [f"Per {law.per} area."] if issubclass(law, Potential) else []
    return "\n\n".join(parts)


def _parameter_row(law: type[Law], name: str, spec: Spec) -> tuple[str, ...]:
    allowed = spec.range.replace(">=", "≥").replace("<=", "≤")
    return f"`{name}`", _unit(spec.unit), spec.text, "" if allowed == "any" else allowed, _default(law, name)


def _default(kind: Any, name: str) -> str:
    default = next(item.default for item in dataclasses.fields(kind) if item.name == name)
    if default is dataclasses.MISSING:
        return "required"
    if default in (None, ""):
        return ""
    return f"{default:g}" if isinstance(default, float) else f"`{default}`"


def _unit(unit: str) -> str:
    """A unit with raised powers; [x] is the unit of the quantity that varies or is prescribed."""
    return re.sub(r"\^(-?\d+)", lambda m: f"<sup>{m[1].replace('-', '−')}</sup>", unit.replace("[x]", "x"))


def table(heading: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table; columns that are empty throughout are left out."""
    used = [i for i in range(len(heading)) if any(row[i] for row in rows)]
    lines = [
        [heading[i] for i in used],
        ["---"] * len(used),
        *([row[i].replace("|", "\\|") for i in used] for row in rows),
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


# -- tables that pages ask for ----------------------------------------------------------------------------------------


def made_references() -> str:
    """Every exact solution."""
    kinds = references.all()
    rows = [(f"[`{name}`](#{name})", inline(kind)) for name, kind in kinds.items()]
    return "\n\n".join([table(("name", "what it is"), rows), *(_reference(name, kind) for name, kind in kinds.items())])


def _reference(name: str, kind: type[references.Reference]) -> str:
    specs = [(item.name, item.metadata["spec"]) for item in dataclasses.fields(kind)]  # type: ignore[arg-type]
    rows = [_parameter_row(kind, field, spec) for field, spec in specs]  # type: ignore[arg-type]
    return "\n\n".join(
        [
            f"## `{name}` {{ #{name} }}",
            markdown(inspect.getdoc(kind) or ""),
            table(("parameter", "unit", "meaning", "range", "if not given"), rows),
        ]
    )


def made_cases() -> str:
    """Every shipped case: title, regime, exact solution, its text and its figure."""
    found = [cases.load(name) for name in cases.names()]
    rows = [
        (
            f"[`{case.name}`](#{case.name})",
            case.title,
            case.system().regime,
            f"[`{case.reference.name}`](exact-solutions.md#{case.reference.name})" if case.reference else "",
        )
        for case in found
    ]
    thumbnails = [
        f"[![](images/gallery-{case.name}.svg){{ loading=lazy }}{case.title}](#{case.name})" for case in found
    ]
    parts = ['<div class="thumbnails" markdown>', *thumbnails, "</div>"]
    parts += [table(("case", "title", "thermal regime", "exact solution"), rows)]
    for case in found:
        parts += [f"## `{case.name}` {{ #{case.name} }}", f"```yaml\n{case.text.rstrip()}\n```"]
        parts += [f"![{case.title}](images/gallery-{case.name}.svg)"]
    return "\n\n".join(parts)


def made_mechanisms() -> str:
    """Every shipped mechanism with the first paragraph of its description."""
    from ruamel.yaml import YAML

    rows = []
    for path in sorted(data.mechanisms().glob("*.yaml")):
        text = " ".join(str(YAML(typ="safe").load(path).get("description", "")).split("\n\n")[0].split())
        rows.append((f"`{path.name}`", text))
    return table(("file", "what it is"), rows)


def made_rate_types() -> str:
    """Every rate type of a mechanism with its own keys, formula and source."""
    from surfacechem.mechanism.rates import CANTERA_PREFIX, kinds

    rows = []
    for kind, law in sorted(kinds().items()):
        specs = dict(law.specs())
        own = ", ".join(f"`{key}` [{specs[name].unit}]" for key, name in law.own_keys().items())
        rows.append(
            (
                f"`{kind.removeprefix(CANTERA_PREFIX)}`",
                own or "–",
                inline(law).partition(" in a mechanism")[0],
                listing.source(law),
            )
        )
    return table(("`type`", "keys beside `rate-constant`", "what it is", "source"), rows)


def made_variables(name: str) -> str:
    """The variables of a case's dataset."""
    dataset = surfacechem.run(name).dataset
    rows = []
    for key, variable in dataset.variables.items():
        attributes = variable.attrs
        unit = re.sub(r"(?<=[A-Za-z])(-?\d+)", r"<sup>\1</sup>", attributes.get("units", ""))
        words = attributes.get("long_name", ""), attributes.get("equation", "")
        rows.append((f"`{key}`", unit.replace("-", "−"), *words))
    return table(("variable", "unit", "long name", "equation"), rows)


LINKS = {
    "history": "#histories",
    "surface mechanism": "mechanisms.md",
    "exact solution": "exact-solutions.md",
    "what fills the space": "heat-paths.md#media",
    "temperatures across the body": "heat-paths.md#bodies-with-conduction",
    "stages": "#programme",
    "mounted": "#mechanics",
    "an event": "events.md",
    "follow from it": "accuracy.md#asking-for-an-accuracy",
}
"""Pages that tell more of what keys of a case hold."""


def made_keys(section: str, *more: str) -> str:
    """The keys of a section of a case file, and some of those that its laws add."""
    from surfacechem.format import declarations, sections

    cls: Any = getattr(sections, section)
    if issubclass(cls, declarations.Section):
        extra = cls.more_keys(None)
        keys = {**declarations.keys(cls), **{name: extra[name] for name in more}}
    else:
        keys = declarations.law_keys(cls)
    rows = [(f"`{name}`", _linked(item.text), *_held(item)) for name, item in keys.items()]
    return table(("key", "meaning", "holds", "unit", "range", "if not given"), rows)


def _held(item: Any) -> tuple[str, ...]:
    """Content of a key: in words, its unit, its range, its default."""
    from surfacechem.format import declarations as d

    law = item.content.content if isinstance(item.content, d.ListOf) else item.content
    words = _linked(_words(item.content))
    if isinstance(law, d.OneLaw):
        families = FAMILIES[law.contract]
        words = "list of laws: " + ", ".join(f"[{family.replace('_', ' ')}](laws/{family}.md)" for family in families)
    spec = item.content.spec if isinstance(item.content, d.Number) else None
    allowed = spec.range.replace(">=", "≥").replace("<=", "≤").replace("any", "") if spec else ""
    default = "required" if item.required else f"{item.default:g}" if isinstance(item.default, int | float) else ""
    default = f"`{item.default}`" if isinstance(item.default, str) and item.default else default
    return words, _unit(item.unit) if item.unit != "1" else "", allowed, default


def _words(content: Any) -> str:
    """Content of a key in words; empty for what a section refers to later."""
    from surfacechem.format import declarations as d

    if isinstance(content, d.Number | d.Integer):
        kind = "number" if isinstance(content, d.Integer) else "quantity"
        return f"{kind} or `{content.word}`" if content.word else kind
    if isinstance(content, d.ByShape):
        return " or ".join(filter(None, map(_words, content.contents)))
    if isinstance(content, d.ListOf):
        return f"list of {_words(content.content)}".removesuffix(" of ")
    if isinstance(content, d.OneOf):
        return ", ".join(f"`{name}`" for name in content.names())
    if isinstance(content, d.OneLaw):
        return f"{content.contract.contract} laws"
    if isinstance(content, d.Entries):
        return content.words
    return {d.Text: "text", d.Prescribed: "history", d.Temperature: "name or history", d.Nested: "mapping"}.get(
        type(content), ""
    )


def _linked(text: str) -> str:
    """A text with links to the pages that tell more."""
    for words, page in LINKS.items():
        text = text.replace(words, f"[{words}]({page})", 1)
    return text


def made_variable_table() -> str:
    """Table of the variables that laws may read and cases may prescribe."""
    from surfacechem.model.components.interface import LOADABLE

    can = {*LOADABLE, "T_1", "T_2", "T_c"}
    rows = [(f"`{name}`", _unit(q.unit), q.long_name, "yes" if name in can else "") for name, q in VARIABLES.items()]
    return table(("name", "unit", "meaning", "may be prescribed"), rows)


def made_cli() -> str:
    """The help of every command."""
    from typer.main import get_command
    from typer.testing import CliRunner

    from surfacechem.cli.main import app

    names = [None, *get_command(app).commands]  # type: ignore[attr-defined]
    parts = []
    for name in names:
        arguments = ["--help"] if name is None else [name, "--help"]
        text = CliRunner().invoke(app, arguments, prog_name="surfacechem", terminal_width=100).output
        title = "## `surfacechem`" if name is None else f"## `surfacechem {name}` {{ #{name} }}"
        parts += [title, f"```text\n{text.strip()}\n```"]
    return "\n\n".join(parts)


def made_solvers() -> str:
    """Names of the solvers."""
    from surfacechem import solve as solvers

    return ", ".join(f"`{name}`" for name in solvers.names)


@cache
def stability_study() -> Any:
    """The matrix that the page on stability and its figure show: two solvers are quick enough for every build."""
    return stability(solvers=["radau", "lsoda"], quick=True, rounds=0)


def made_stability() -> str:
    """Table of the results of each solver in each regime."""
    summary = stability_study().sections[0].tables[0]
    return table(("regime", "from .. to", *summary.heading[2:]), [tuple(row) for row in summary.rows])


def made_regimes() -> str:
    """Every regime: what it is, its parameter, its values."""
    rows = []
    for name, regime in regimes().items():
        values = ", ".join(map(regime.label, regime.values))
        rows.append(
            (f"`{name}`", markdown(" ".join((inspect.getdoc(regime.problem) or "").split())), regime.symbol, values)
        )
    return table(("regime", "what it is", "parameter", "values"), rows)


def made_pictures(name: str) -> str:
    """The figures of a list, each with its caption."""
    shown = []
    for picture in drawn(name):
        number = f"images/list-{name}-{picture.section.name}.svg"
        shown.append(f"![{picture.section.title}]({number})\n\n*{picture.caption}*")
    return "\n\n".join(shown)


@cache
def drawn(name: str) -> list[Any]:
    """The figures of a shipped list, computed once."""
    from surfacechem.studies.figures import pictures, read_list

    return list(pictures(read_list(name)))


def made_list_keys(section: str) -> str:
    """The keys of a section of a list of figures."""
    from surfacechem.format import declarations
    from surfacechem.studies import figures

    keys = declarations.keys(getattr(figures, section))
    rows = [(f"`{name}`", item.text, *_held(item)) for name, item in keys.items()]
    return table(("key", "meaning", "holds", "unit", "range", "if not given"), rows)


def made_ratios() -> str:
    """Table of run times of other libraries relative to ours, as the benchmark has kept them."""
    with (RESULTS / "ratios.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    wanted = [(case, error) for case in ("P1", "P2", "P3", "P4") for error in ("1e-06", "1e-10")]
    found = {(row["solver"], row["case"], row["error"]): row["times ours"] for row in rows}
    names = [name for name in dict.fromkeys(row["solver"] for row in rows) if name not in OURS]
    heading = ("", *(f"{case} 10<sup>-{int(error[3:])}</sup>" for case, error in wanted))

    def cell(value: str | None) -> str:
        return "" if value is None else "not reached" if value == "nan" else f"{float(f'{float(value):.2g}'):g}"

    return table(heading, [(name, *(cell(found.get((name, *key))) for key in wanted)) for name in names])


def made_growth() -> str:
    """The power of the size with which each cost grows at the end."""
    with (RESULTS / "growth.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    costs = list(dict.fromkeys(row["cost"] for row in rows))
    shown = []
    for name in dict.fromkeys(row["grows"] for row in rows):
        cells = []
        for cost in costs:
            found = [(float(r["size"]), float(r["seconds"])) for r in rows if (r["grows"], r["cost"]) == (name, cost)]
            if not found:
                cells.append("")
                continue
            (small, before), (large, seconds) = found[-2:]
            power = round(math.log(seconds / before) / math.log(large / small), 1) + 0.0  # no negative zero
            cells.append(f"{seconds:.2g} s at {large:,.0f}, power {power:.1f}")
        shown.append((name, *cells))
    return table(("", *costs), shown)


RESULTS = Path(__file__).parents[1] / "benchmarks" / "results"
OURS = ("radau", "dop853", "lsoda", "bdf", "scipy-radau", "cvode", "ida", "cantera")
"""Solvers that are reached through a case: ours, and adapters."""

MAKERS: dict[str, Callable[..., str]] = {
    "references": made_references,
    "cases": made_cases,
    "mechanisms": made_mechanisms,
    "rate_types": made_rate_types,
    "variables": made_variables,
    "keys": made_keys,
    "variable_table": made_variable_table,
    "cli": made_cli,
    "solvers": made_solvers,
    "ratios": made_ratios,
    "growth": made_growth,
    "stability": made_stability,
    "regimes": made_regimes,
    "pictures": made_pictures,
    "list_keys": made_list_keys,
}

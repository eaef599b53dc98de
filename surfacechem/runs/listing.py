"""Output of commands as text: a title, facts and tables; and listings of the laws by contract and of the cases.

A sheet is plain as text; on a terminal it has colours.
"""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields

from surfacechem.contracts.terms import Law
from surfacechem.documents import cases
from surfacechem.errors import LAWS, refuse_unknown
from surfacechem.laws import FAMILIES, laws

Rows = Sequence[Sequence[str]]


@dataclass(frozen=True)
class Sheet:
    """A title, facts and tables by heading.

    >>> print(Sheet("Two bodies", [("ended", "finished")], {"States": [("T", "[K]"), ("phi", "[1]")]}))
    Two bodies
      ended      finished
    States
      T    [K]
      phi  [1]
    """

    title: str = ""
    facts: Sequence[tuple[str, str]] = ()
    """Label and text of each; one without a text is left out."""
    tables: Mapping[str, Rows] = field(default_factory=dict)

    def __str__(self) -> str:
        """Plain text."""
        lines = [self.title] if self.title else []
        lines += [f"  {label:<10} {text}" for label, text in self.facts if text]
        for heading, rows in self.tables.items():
            lines += [heading] if heading and rows else []
            lines += [f"{'  ' if lines else ''}{line}" for line in columns(rows)] if rows else []
        return "\n".join(lines)


def counted(count: int, what: str) -> str:
    """Return a number with its noun, in the plural if need be.

    >>> counted(1, "run"), counted(61, "run")
    ('1 run', '61 runs')
    """
    return f"{count} {what}{'s' if count != 1 else ''}"


ALIGNED = 72
"""Letters up to which a cell takes part in the alignment of its column."""


def columns(rows: Iterable[Sequence[str]]) -> list[str]:
    """Format rows as text in aligned columns; what is beside a long cell begins after it."""
    table = [list(row) for row in rows]
    sizes = [[len(cell) for cell in column if len(cell) <= ALIGNED] for column in zip(*table, strict=True)]
    widths = [max(column, default=0) for column in sizes]
    return ["  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in table]


TEXT_WIDTH = 110
TABLE = """
alpha α  beta β  delta δ  Delta Δ  eta η  theta θ  kappa κ  lambda λ  mu μ  nu ν  pi π  Pi Π  rho ρ  sigma σ
Sigma Σ  tau τ  phi φ  psi ψ  Psi Ψ  omega ω  varepsilon ε  epsilon ε  chi χ  gamma γ  xi ξ  ge ≥  le ≤  cdot ·
times ×  partial ∂  infty ∞  pm ±  to →  int ∫  sum Σ  prod Π  approx ≈  simeq ≃  propto ∝  ll ≪  gg ≫  ne ≠
langle ⟨  rangle ⟩  ell ℓ  Lambda Λ  Phi Φ  wedge ∧  vee ∨
"""
SIGNS = dict(zip(TABLE.split()[::2], TABLE.split()[1::2], strict=True))
"""LaTeX commands with one character; function names keep their letters."""

FUNCTIONS = r"(?:ln|exp|sin|cos|min|max)"

TITLE = re.compile(r"^title: (.*)$", re.MULTILINE)
"""The title of a shipped case; to read all cases as YAML would take half a second."""

FORMULA = re.compile(r"\.\. math::((?:.*\n)(?:[ \t]+.*\n?)*)")
ROLE = re.compile(r":math:`([^`]*)`")

ACCENTED = r"\s*(?:\{\s*(\w)\s*\}|(\w))"
"""The argument of an accent: one letter, in braces or not."""


def plain(latex: str) -> str:
    """Convert a LaTeX formula to text.

    >>> plain(chr(92) + "dot" + chr(92) + "phi = -" + chr(92) + "frac{M}{N_c}")
    'dφ/dt = -M/N_c'
    """
    text = re.sub(r"\s*\\\\\s*", "; ", latex.replace(r"\begin{cases}", "(").replace(r"\end{cases}", ")"))
    text = re.sub(r"\\q?quad", "\0", re.sub(r"\\(?:left|right)\b|\\[,!;: ]|&", " ", text))
    text = re.sub(r"(?<=\w)(?=\\)", " ", text)
    text = re.sub(r"\\([A-Za-z]+)", lambda m: SIGNS.get(m[1], m[0]), text)
    for command, power in (("dot", ""), ("ddot", "²")):
        rate = rf"d{power}\1\2\3/dt{power} "
        text = re.sub(rf"\\{command}{ACCENTED}(_\{{(?:[^{{}}]|\{{[^{{}}]*\}})*\}}|_\w)?", rate, text)
    text = re.sub(rf"\\bar{ACCENTED}", r"\1\2_mean ", text)
    text = re.sub(rf"\\hat{ACCENTED}", r"\1\2_max ", text)
    text = re.sub(r"\\(?:text|mathrm|mathcal|operatorname)\s*\{([^{}]*)\}", r"\1", text)
    text = re.sub(rf"\\({FUNCTIONS})\b\s*(?=\w)", r"\1 ", text)
    text = re.sub(rf"\\({FUNCTIONS})\b", r"\1", text)
    while (reduced := _unnested(text)) != text:
        text = reduced
    text = re.sub(r"\\([a-zA-Z]+)", r"\1", text).replace("\\{", "(").replace("\\}", ")")
    text = re.sub(r"\s+([,;)\]⟩])|\s*(\0)\s*", r"\1\2", re.sub(r"\s+", " ", text))
    text = re.sub(r"([(\[/⟨]) ", r"\1", text.replace(" /", "/")).replace("\0", "  ").strip()
    return re.sub(r"(?<=[=(,] -) (?=\w)|(?<=\(-) (?=\w)", "", re.sub(rf"\b({FUNCTIONS}) \(", r"\1(", text))


def _unnested(text: str) -> str:
    """Write the innermost fractions, roots, powers and subscripts without braces."""
    inner = r"\s*\{([^{}\\]*)\}"
    either = r"\s*(?:\{([^{}\\]*)\}|(\w))"
    text = re.sub(rf"({FUNCTIONS}\s*)\\[dt]?frac{either}{either}", r"\1(\\frac{\2\3}{\4\5})", text)
    text = re.sub(rf"\\[dt]?frac{either}{either}", lambda m: f"{_atom(m[1] or m[2])}/{_atom(m[3] or m[4])} ", text)
    text = re.sub(rf"\\sqrt{either}", r"sqrt(\1\2)", text)
    text = re.sub(rf"\^{inner}", lambda m: f"^{_atom(m[1])}", text)
    text = re.sub(rf"(\b{FUNCTIONS}){inner}", r"\1\2", re.sub(rf"\|{inner}\s*\|", r"|\1|", text))  # sin{(x)}, |{x}|
    return re.sub(rf"_{inner}", lambda m: f"_({m[1]})" if " " in m[1].strip() else f"_{m[1]}", text)


def _atom(text: str) -> str:
    return text.strip() if re.fullmatch(r"\s*-?[\w.^]+\s*", text) else f"({text.strip()})"


def law_list() -> list[Sheet]:
    """List the laws by contract, one per line."""
    sheets = []
    for contract in FAMILIES:
        rows = [(name, _first_line(law)) for name, law in laws(contract).items()]
        sheets.append(Sheet(f"{contract.contract.upper()}: {_first_line(contract)}", tables={"": rows}))
    return [*sheets, Sheet("`surfacechem laws NAME` shows all about a law, or about those of a contract.")]


def law_table(contract: type[Law]) -> str:
    """Describe the laws of a contract: statement, formulas, parameters and source of each."""
    parts = [f"{contract.contract.upper()}: {_first_line(contract)}"]
    for law in laws(contract).values():
        texts = [_first_line(law), *formulas(law), *parameters(law), f"Source: {source(law)}"]
        wrapper = textwrap.TextWrapper(TEXT_WIDTH, " " * 6, " " * 10, break_on_hyphens=False)
        parts.append("\n".join([f"  {law.name()}", *map(wrapper.fill, texts)]))
    return "\n\n".join(parts)


def _first_line(kind: type) -> str:
    return " ".join(inspect.getdoc(kind).split("\n\n")[0].split())  # type: ignore[union-attr]


def formulas(law: type[Law]) -> list[str]:
    """Return the formulas of a law's docstring as text."""
    return [plain(" ".join(block.split())) for block in FORMULA.findall(f"{inspect.getdoc(law)}\n")]


def parameters(law: type[Law]) -> Iterator[str]:
    """Yield one line for each parameter and option."""
    for name, spec in law.specs():
        allowed = "" if spec.range == "any" else f", {spec.range}"
        default = next(item.default for item in fields(law) if item.name == name)
        usual = "" if default in (MISSING, None) else f", {default:g} if not given"
        yield f"{name} [{spec.unit.replace('[x]', 'x')}]: {spec.text}{allowed}{usual}"
    for name, text in law.options():
        yield f"{name}: {text}"


def source(law: type[Law]) -> str:
    """Return the source of a law as given in its docstring."""
    found = re.search(r"Source: (.*?)(?:\n\n|\Z)", inspect.getdoc(law) or "", re.DOTALL)
    text = " ".join(found[1].split()) if found else "not stated"
    return ROLE.sub(lambda m: plain(m[1]), text)


def law_page(name: str) -> str:
    """Describe all laws of that name, or of that contract: docstring, parameters and their ranges."""
    if asked := [contract for contract in FAMILIES if contract.contract == name]:
        return law_table(asked[0])
    every = [(contract, law) for contract in FAMILIES for law in laws(contract).values()]
    found = [(contract, law) for contract, law in every if law.name() == name]
    names = {contract.contract for contract in FAMILIES} | {law.name() for _, law in every}
    refuse_unknown([name], names, "no law '{}'", listed_by=LAWS)

    def apart(formula: re.Match[str]) -> str:
        """Indent formulas, each on its own line if they are too long for one."""
        text = plain(" ".join(formula[1].split()))
        text = text if len(text) < TEXT_WIDTH else text.replace(",  ", ",\n").replace(";  ", ";\n")
        return f"{textwrap.indent(text, '    ')}\n"

    pages = []
    for contract, law in found:
        doc = FORMULA.sub(apart, f"{inspect.getdoc(law)}\n")
        text = textwrap.indent(ROLE.sub(lambda m: plain(m[1]), doc).rstrip(), "  ")
        listed = "\n".join(f"  {line}" for line in parameters(law)) or "  none"
        pages.append(f"{name} ({contract.contract})\n\n{text}\n\nParameters\n{listed}")
    return "\n\n".join(pages)


def case_table() -> Sheet:
    """List names and titles of the shipped cases."""
    rows = [(path.stem, TITLE.findall(path.read_text(encoding="utf-8"))[0]) for path in sorted(cases().glob("*.yaml"))]
    return Sheet(tables={"": rows}) if rows else Sheet("no cases are installed")


def case_text(name: str) -> str:
    """Return the text of a shipped case; InputError with the nearest name if there is none."""
    known = {path.stem: path for path in cases().glob("*.yaml")}
    refuse_unknown([name], known, "no case '{}' comes with the package")
    return known[name].read_text(encoding="utf-8")

"""Output of commands: a title, facts under their labels, and tables; plain as text, on a terminal with colours."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

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
    """Label and text of each."""
    tables: Mapping[str, Rows] = field(default_factory=dict)

    def __str__(self) -> str:
        """Plain text."""
        lines = [self.title] if self.title else []
        lines += [f"  {label:<10} {text}" for label, text in self.facts]
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


def columns(rows: Iterable[Sequence[str]]) -> list[str]:
    """Format rows as text in aligned columns."""
    table = [list(row) for row in rows]
    widths = [max(len(cell) for cell in column) for column in zip(*table, strict=True)]
    return ["  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip() for row in table]

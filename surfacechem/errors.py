"""Errors a user can act on: place, thing, what is allowed, nearest guess."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Place:
    """Where in the input something stands: file, line (from 1), the dotted path of keys, and column (from 0)."""

    file: str = ""
    line: int = 0
    path: str = ""
    column: int = field(default=0, compare=False)

    def __str__(self) -> str:
        location = f"{self.file}:{self.line}" if self.line else self.file
        return ": ".join(part for part in (location, self.path) if part)


class SurfacechemError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(SurfacechemError):
    """The input is wrong; nothing was computed. The message is one line, whatever of the input it quotes."""

    def __init__(self, message: str, place: Place | None = None) -> None:
        self.message = printable(message)
        self.place = place
        super().__init__(printable(f"{place}: {message}" if place and str(place) else message))

    def at(self, place: Place) -> InputError:
        """The same error with its place, unless it already knows one."""
        return self if self.place else type(self)(self.message, place)


def printable(text: str) -> str:
    r"""The text with line breaks and control characters as their escapes.

    >>> print(printable("unknown key 'load\ning'"))
    unknown key 'load\ning'
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def suggestion(name: str, known: Iterable[str]) -> str:
    """``" Did you mean 'x'? Known: x, y."`` for a name that is not among the known ones."""
    names = sorted(known)
    return f"{nearest(name, names)} Known: {', '.join(names) or 'none'}."


def nearest(name: str, known: Iterable[str]) -> str:
    """``" Did you mean 'x'?"`` for a name that is not among the known ones, nothing where none of them is like it."""
    names = sorted(known)
    close = difflib.get_close_matches(name.lower(), [n.lower() for n in names], n=1, cutoff=0.6)
    guess = next((n for n in names if close and n.lower() == close[0]), None)
    return f" Did you mean '{guess}'?" if guess else ""

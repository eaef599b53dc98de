"""Errors that a user can act on: place, thing, allowed values, nearest guess."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, Self, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

LINES, NEAR = 240, 6
"""Total length of names [characters] up to which a message lists all, some two lines; and the number of nearest ones
that it lists otherwise.
"""

LAWS, PATHS = "`surfacechem laws`", "`surfacechem equations CASE`"
"""Commands in messages that list all laws, and all paths of parameters of a case."""

LONGEST = 2000
"""Largest length of a message [characters]; nobody reads more."""

LONG_PART = re.compile(rf"(?<!\w)'[^']{{{LINES},}}'(?!\w)|\S{{{LONGEST // 2},}}")
"""A quoted value of more than two lines, or a word that is too long for the path of a file."""

LIKE = 0.6
"""Similarity of two names above which one is suggested for the other: a choice, that of `difflib`."""

FILE_SUFFIX = re.compile(r"\.(ya?ml|nc|csv)$")


@dataclass(frozen=True)
class Place:
    """Location in the input: file, line (from 1), the dotted path of keys, and column (from 0)."""

    file: str = ""
    line: int = 0
    path: str = ""
    column: int = field(default=0, compare=False)

    def __str__(self) -> str:
        location = f"{self.file}:{self.line}" if self.line else self.file
        return ": ".join(part for part in (location, self.path) if part)


class SurfacechemError(Exception):
    """Base of every error this package raises on purpose."""


class PlacedError(SurfacechemError):
    """An error message of one printable line, with the place in the input that it is about.

    Code without access to the file gives the ``path`` in the case, to which the reader of the case adds file and line.
    """

    def __init__(self, message: str, place: Place | None = None, *, path: str = "") -> None:
        self.message = message = shortened(printable(message))
        self.place = place = place or (Place(path=path) if path else None)
        super().__init__(shortened(printable(f"{place}: {message}" if place and str(place) else message)))

    def at(self, place: Place) -> Self:
        """Return the same error with its place, unless it already has one."""
        return self if self.place else type(self)(self.message, place)


class InputError(PlacedError):
    """The input is wrong; nothing was computed."""


@contextmanager
def placed(place: Place) -> Iterator[None]:
    """Add this place to input errors raised in a block, unless they already have one."""
    try:
        yield
    except InputError as error:
        raise error.at(place) from None


def concise(entry: F) -> F:
    """Decorate a function that users call: the traceback of an input error ends at their call, not at our insides."""

    @wraps(entry)
    def called(*arguments: Any, **options: Any) -> Any:
        try:
            return entry(*arguments, **options)
        except InputError as error:
            raise error.with_traceback(None)  # noqa: B904 - the same error, with the cause that it has

    return cast(F, called)


class OutputError(PlacedError):
    """Computed results could not be written."""


def printable(text: str) -> str:
    r"""Return text with line breaks and control characters as escapes.

    >>> print(printable("unknown key 'load\ning'"))
    unknown key 'load\ning'
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def shortened(text: str) -> str:
    """Return a text without the middle of what is too long to be read: of quoted values and words, and of the rest.

    >>> shortened(f"unknown key '{'long' * 1250}'. Known: run.")
    "unknown key 'longlonglonglonglonglonglonglonglonglon [...] onglonglonglonglong'. Known: run."
    """
    text = LONG_PART.sub(lambda part: f"{part[0][:40]} [...] {part[0][-20:]}", text)
    half = LONGEST // 2
    return text if len(text) <= LONGEST else f"{text[:half]} [...] {text[-half:]}"


MOST_LISTED = 6
"""Number of names that a message lists: a mechanism may have hundreds."""


def listed(names: Sequence[str], most: int = MOST_LISTED) -> str:
    """Return names with commas; of many the first ones, and how many more there are.

    >>> listed(["R1", "R2", "R3"]), listed(["R1", "R2", "R3"], 2)
    ('R1, R2, R3', 'R1, R2 and 1 more')
    """
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def suggestion(name: str, known: Iterable[str], listed_by: str = "") -> str:
    """Return ``" Did you mean 'x'? Known: x, y."`` for an unknown name.

    Of many known names the nearest are listed, with the command or the page that lists all.

    >>> suggestion("mu_s", ["k", "mu"])
    " Did you mean 'mu'? Known: k, mu."
    >>> suggestion("k99", [f"k_{i}" for i in range(100)], "`surfacechem laws`")
    " Did you mean 'k_99'? Nearest of 100: k_99, k_9, k_19, k_29, k_39, k_49. `surfacechem laws` lists all."
    """
    names = sorted(map(str, known))
    if len(every := ", ".join(names)) <= LINES:
        return f"{nearest(name, names)} Known: {every or 'none'}."
    like = sorted(names, key=lambda other: likeness(name, other), reverse=True)[:NEAR]
    more = f" {listed_by} lists all." if listed_by else ""
    return f"{nearest(name, names)} Nearest of {len(names)}: {', '.join(like)}.{more}"


def refuse_unknown(
    names: object, known: Collection[str], message: str, place: Place | None = None, listed_by: str = ""
) -> None:
    """Raise InputError for the first name that is not among the known ones; {} in the message stands for it.

    >>> refuse_unknown(["k", "mu_s"], ["k", "mu"], "no parameter '{}'")
    Traceback (most recent call last):
        ...
    surfacechem.errors.InputError: no parameter 'mu_s'. Did you mean 'mu'? Known: k, mu.
    """
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise InputError(f"a list of names is needed, not {names!r}.", place)
    for name in names:
        if not isinstance(name, str) or name not in known:
            raise InputError(f"{message.replace('{}', str(name))}.{suggestion(str(name), known, listed_by)}", place)


def expect(value: object, kinds: type | tuple[type, ...], wanted: str, place: Place | None = None) -> None:
    """Raise InputError for a value from Python that is none of these kinds; ``wanted`` says what is.

    >>> expect(3, str, "a case is a text")
    Traceback (most recent call last):
        ...
    surfacechem.errors.InputError: a case is a text, not int.
    """
    if not isinstance(value, kinds):
        raise InputError(f"{wanted}, not {type(value).__name__}.", place)


def nearest(name: str, known: Iterable[str]) -> str:
    """Return ``" Did you mean 'x'?"`` for an unknown name, or an empty text if no known one is similar.

    >>> nearest("cluster", ["bouncing-plate", "adhesion-cluster-held"]), nearest("debonding.yml", ["ends.yaml"])
    (" Did you mean 'adhesion-cluster-held'?", '')
    >>> nearest("mu", ["interface.friction.coulomb.mu", "interface.friction.coulomb.mu_s", "initial.u"])
    " Did you mean 'interface.friction.coulomb.mu'?"
    """
    guess = max(sorted(map(str, known)), key=lambda other: likeness(name, other), default="")
    return f" Did you mean '{guess}'?" if guess and likeness(name, guess)[0] >= LIKE else ""


def likeness(name: str, other: str) -> tuple[float, float]:
    """Return the similarity of two names, without file suffixes, then with them.

    A name whose words are all contained in the other counts as more similar than by its spelling, and all the more if
    the other is a path that ends with it.
    """
    one, two = (FILE_SUFFIX.sub("", text.lower()) for text in (name[:LONGEST], other))
    words = [word for word in re.split(r"[^a-z0-9]+", one) if word]
    inside = bool(words) and all(re.search(rf"(?<![a-z0-9]){word}", two) for word in words)
    same = difflib.SequenceMatcher(None, two, one).ratio()
    ends = two.removesuffix(".level").endswith(f".{one}")
    return (1 + same) / 2 + ends if inside else same, difflib.SequenceMatcher(None, other, name[:LONGEST]).ratio()

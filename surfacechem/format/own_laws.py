"""User-defined laws of a case: Python files that it names, with checksums; a dataset contains their source.

Code runs only if a line of the case names its file, or if the user allows it, never because a dataset is opened.
"""

from __future__ import annotations

import hashlib
import linecache
import sys
import traceback
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType

from surfacechem import laws
from surfacechem.contracts.terms import Law
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, PlacedError

FILE_KEYS = ("file", "sha256", "python")

_run: dict[str, ModuleType] = {}
"""Modules whose code this process has run, by checksum; they may be requested again."""


def embedded(tree: Tree, base: Path, allow_code: bool = False) -> tuple[Tree, list[type[Law]]]:
    """Insert source and checksum of every law file that the tree names, and return the tree and these laws.

    Source in the tree itself, as in the case of a dataset, is executed only with ``allow_code``, or if this process has
    executed it before.
    """
    given = tree.value.get("laws") if isinstance(tree.value, dict) else None
    if given is None:
        return tree, []
    entries: list[Tree] = []
    found: list[type[Law]] = []
    for entry in given.items("laws: [my_laws.py]"):
        fields = {"file": entry} if isinstance(entry.value, str) else entry.mapping(FILE_KEYS)
        if "file" not in fields:
            raise entry.error("a file of laws needs its name, `file: my_laws.py`.")
        name = fields["file"].text("a file of laws")
        inside = fields.get("python")
        source = str(inside.value) if inside else document.read(document.named(fields["file"], base, "a file of laws"))
        checksum = hashlib.sha256(source.encode()).hexdigest()
        if inside and not allow_code and checksum not in _run:
            raise inside.error(
                f"the case carries code of its own, {name}, which runs only where you allow it: by `--allow-code`, or "
                "`allow_code=True` in Python. Read it before."
            )
        if "sha256" in fields and fields["sha256"].value != checksum:
            message = f'{name} is another file than the one meant: its checksum is `sha256: "{checksum}"`.'
            raise fields["sha256"].error(message)
        found += read(source, name, entry.place)
        texts = {"file": name, "sha256": checksum, "python": source}
        entries.append(Tree({key: Tree(text, entry.place) for key, text in texts.items()}, entry.place))
    return replace(tree, value={**tree.value, "laws": replace(given, value=entries)}), found


def read(source: str, name: str, place: Place | None = None) -> Sequence[type[Law]]:
    """Return the laws that Python source defines; InputError with its line if it fails, or defines none."""
    checksum = hashlib.sha256(source.encode()).hexdigest()
    if checksum not in _run:
        module = ModuleType(f"surfacechem_laws_{checksum[:16]}")
        module.__file__ = name
        # Dataclasses need the module of a class, tracebacks and doctests its lines.
        sys.modules[module.__name__] = module
        linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
        try:
            exec(compile(source, name, "exec"), vars(module))
        except (Exception, SystemExit) as error:
            del sys.modules[module.__name__]
            lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == name]
            line = error.lineno if isinstance(error, SyntaxError) else (lines or [0])[-1]
            raise InputError(_failure(error), Place(name, line or 0)) from error
        _run[checksum] = module
    found = laws.laws_of_module(_run[checksum])
    if not found:
        raise InputError(f"{name} defines no law: a law is a subclass of Friction or of another contract.", place)
    for law in found:
        laws.check_own(law)
    return found


def _failure(error: BaseException) -> str:
    """Return the message of an error raised by user-defined code."""
    if isinstance(error, PlacedError):
        return error.message
    if isinstance(error, SystemExit):
        return "the file ends the process (SystemExit); it is to define laws only."
    return f"{type(error).__name__}: {error.msg if isinstance(error, SyntaxError) else error}"

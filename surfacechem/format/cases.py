"""Case files: a YAML document becomes a scene, a run and, optionally, an exact solution to compare with.

A case may name Python files with laws of a user, with checksums; a dataset contains their source. Code runs only if a
line of the case names its file, or if the user allows it, never because a dataset is opened.

>>> case = load("endothermic", ["run.until=2 s"])
>>> case.run.times[-1], [body.name for body in case.scene.bodies]
(2.0, ['lower', 'upper'])
"""

from __future__ import annotations

import hashlib
import linecache
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from io import BufferedIOBase, TextIOBase
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from surfacechem import documents, laws
from surfacechem.contracts.terms import Law
from surfacechem.documents import document
from surfacechem.documents.document import Tree
from surfacechem.errors import InputError, Place, PlacedError, expect, nearest
from surfacechem.format import data_files
from surfacechem.format.reader import ExactSolution, exact_solution_of, read_document, run_of, scene_of
from surfacechem.format.sections import NOTHING_SWEPT, SweepSection
from surfacechem.model.assemble import assemble, with_surrogates
from surfacechem.model.system import System
from surfacechem.scene import Scene
from surfacechem.solve.run import Run, refuse_static

if TYPE_CHECKING:
    from surfacechem.format.plans import Plan

FILE_KEYS = ("file", "sha256", "python")

_run: dict[str, ModuleType] = {}
"""Modules whose code this process has run, by checksum; they may be requested again."""


def with_own_laws(tree: Tree, base: Path, allow_code: bool = False) -> tuple[Tree, list[type[Law]]]:
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
            allowed = "where you allow it: by `--allow-code`, or `allow_code=True` in Python. Read it before."
            raise inside.error(f"the case carries code of its own, {name}, which runs only {allowed}")
        if "sha256" in fields and fields["sha256"].value != checksum:
            message = f'{name} is another file than the one meant: its checksum is `sha256: "{checksum}"`.'
            raise fields["sha256"].error(message)
        found += read_laws(source, name, entry.place)
        texts = {"file": name, "sha256": checksum, "python": source}
        entries.append(Tree({key: Tree(text, entry.place) for key, text in texts.items()}, entry.place))
    return tree._replace(value={**tree.value, "laws": given._replace(value=entries)}), found


def read_laws(source: str, name: str, place: Place | None = None) -> Sequence[type[Law]]:
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


Overrides = str | Sequence[str] | Mapping[str, object]


@dataclass(frozen=True)
class Case:
    """A case as read; ``text`` (with ``mechanism_text``) is sufficient to read it again."""

    name: str
    title: str
    source: str
    description: str
    scene: Scene
    own_run: Run | None
    """Run settings; None if the case gives none, since it is only evaluated."""
    reference: ExactSolution | None
    sweep: SweepSection | None
    text: str
    mechanism_text: str | None
    places: Mapping[str, Place]
    file: str
    unused: str = ""
    """Reason why the exact solution of the case does not apply after a change; empty if it does."""

    @property
    def run(self) -> Run:
        """Run settings; InputError if the case gives none."""
        if self.own_run is None:
            self.refuse_nothing()
            message = "the case needs `run`: times, accuracy, solver, for example `run: {until: 5 s}`."
            raise InputError(message, self.places[""])
        return self.own_run

    @cached_property
    def _surrogate_system(self) -> System:
        return assemble(with_surrogates(self.scene))

    def refuse_nothing(self) -> None:
        """Raise InputError if the scene has no state, without computing integrals over surfaces."""
        with self.locating():
            refuse_static(self._surrogate_system, self.file or "CASE")

    def system(self) -> System:
        """Assemble the scene; errors get their place in the case file."""
        with self.locating():
            return assemble(self.scene)

    @contextmanager
    def locating(self, plan: Plan | None = None) -> Iterator[None]:
        """Add file and line to input errors raised in a block, also to those about the parameters of a plan."""
        try:
            yield
        except InputError as error:
            raise self.located(plan.located(error) if plan else error) from None

    def located(self, error: InputError) -> InputError:
        """Return the error with file and line of its path, or of the innermost section around that."""
        if error.place is not None and error.place.file:
            return error
        path = error.place.path if error.place is not None else ""
        while path not in self.places:
            path = path.rpartition(".")[0]
        return InputError(error.message, self.places[path])


Source = str | Path | Mapping[str, object] | TextIOBase | BufferedIOBase
"""A case: its file, the name of a shipped one, its text, its keys and values, or an open file."""


def load(source: Source, overrides: Overrides = ()) -> Case:
    """Read a case from a file, a text of several lines, a mapping or an open file, or a shipped one by its name.

    ``overrides`` are a text "path=value", several of them, or a mapping from path to value; they are applied to the
    document before it is read.
    """
    if isinstance(source, Mapping):
        return load_text(document.dump(document.from_plain(dict(source), Place())), overrides=overrides)
    if isinstance(source, str) and not source.strip():
        raise InputError("the text of the case is empty.")
    if isinstance(source, str) and "\n" in source:
        return load_text(source, overrides=overrides)
    if isinstance(source, TextIOBase | BufferedIOBase):
        file, content = Path(str(getattr(source, "name", "case.yaml"))), source.read()
        text = content if isinstance(content, str) else document.decoded(content, Place(str(file)))
        return load_text(text, file.stem, file.parent, overrides=overrides, file=str(file))
    expect(source, (str, Path), "a case is a path, a name, a text, a mapping or an open file")
    path, shown = _find(str(source))
    return load_text(document.read(path, shown), path.stem, path.parent, overrides=overrides, file=shown)


def load_text(
    text: str,
    name: str = "case",
    base: str | Path = ".",
    mechanism_text: str | None = None,
    overrides: Overrides = (),
    file: str = "",
    allow_code: bool = False,
) -> Case:
    """Read a case from its text; mechanisms are searched for in ``base`` unless their text is given.

    With ``allow_code`` the source of laws in the text, as in that of a dataset, is executed.
    """
    tree = document.parse(text, file or f"{name}.yaml")
    unused = ""
    if overrides:
        before, tree = tree, document.overridden(tree, overrides)
        tree, unused = _without_stale_reference(before, tree)
        text = document.dump(tree)
    # With the contents of its files in the text, a case can be read again without them.
    whole, own = with_own_laws(data_files.with_files(tree, str(base)), Path(base), allow_code)
    if whole != tree:
        tree, text = whole, document.dump(whole)
    with laws.known(own):
        case, mechanism = read_document(tree, str(base), mechanism_text)
    if case.sweep and not case.sweep.tree.value:
        raise case.sweep.error(NOTHING_SWEPT)
    scene = scene_of(case, mechanism)
    run = run_of(case.run) if case.run else None
    return Case(
        name=name,
        title=case.title or name,
        source=case.source,
        description=case.description,
        scene=scene,
        own_run=run,
        reference=exact_solution_of(case.reference) if case.reference else None,
        sweep=case.sweep,
        text=text,
        mechanism_text=mechanism.text if mechanism else None,
        places={each.place.path: each.place for each in tree.walk()},  # a table in a file has no path, like the whole
        file=tree.place.file,
        unused=unused,
    )


def _without_stale_reference(before: Tree, after: Tree) -> tuple[Tree, str]:
    """Return the document without an exact solution whose parameters were given for another scene, and the reason."""
    old, new = ({key: child.plain() for key, child in (tree.value or {}).items()} for tree in (before, after))
    scene = {*old, *new} - {"title", "source", "description", "run", "sweep", "reference"}
    if all(old.get(key) == new.get(key) for key in scene) or old.get("reference") != new.get("reference"):
        return after, ""
    found = exact_solution_of(after.value["reference"]) if "reference" in new else None
    if found is None or not found.fixed:
        return after, ""
    return after._replace(value={key: child for key, child in after.value.items() if key != "reference"}), found.fixed


def names() -> list[str]:
    """Return the names of the cases that come with surfacechem."""
    return sorted(path.stem for path in documents.cases().glob("*.yaml"))


def _find(name: str) -> tuple[Path, str]:
    """Return the file of a case, and its name in messages."""
    path = Path(name)
    if document.is_file(path):
        return path, name
    if name in names():
        return documents.cases() / f"{name}.yaml", f"cases/{name}.yaml"
    beside: list[str] = []
    with suppress(OSError, ValueError):  # a name may be invalid as a path
        if path.exists():
            return path, name
        if path.is_symlink():
            raise InputError(f"is a link to {path.readlink()}, where no file is.", Place(name))
        beside = [file.name for file in path.parent.iterdir() if file.suffix in (".yaml", ".yml")]
    guess = nearest(path.name, [*names(), *beside])
    raise InputError(f"no file and no case '{name}'.{guess} `surfacechem cases` lists those of the package.")

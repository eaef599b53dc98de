"""The mechanism that a case names: found beside the case or among those that come with the package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from surfacechem import data, document
from surfacechem.case.fields import items, mapping, text
from surfacechem.document import Tree
from surfacechem.errors import suggestion

if TYPE_CHECKING:
    from surfacechem.mechanism import Mechanism


def read_mechanism(tree: Tree | None, base: str, content: str | None, evaluate: bool) -> Mechanism | None:
    """The mechanism of a case, or None; ``content`` is its text where that is already at hand.

    With ``evaluate`` what is not lowered is left to Cantera.
    """
    if tree is None:
        return None
    file, phase, bonds = _choice(tree)
    if content is None:
        path = _find(file, Path(base), tree)
        document.read(path)
        return _load(path, phase, bonds, tree, evaluate)
    with TemporaryDirectory() as folder:
        path = Path(folder) / Path(file).name
        path.write_text(content, encoding="utf-8")
        return _load(path, phase, bonds, tree, evaluate)


def _load(path: Path, phase: str | None, bonds: Sequence[str] | None, tree: Tree, evaluate: bool) -> Mechanism:
    from surfacechem.mechanism import load_mechanism

    return load_mechanism(path, phase, bonds, tree.place, evaluate)


def _choice(tree: Tree) -> tuple[str, str | None, Sequence[str] | None]:
    """File, phase and names of the bonds."""
    if not isinstance(tree.value, dict):
        return _with_suffix(text(tree, "the mechanism")), None, None
    fields = mapping(tree, ["file", "phase", "bonds"])
    if "file" not in fields:
        raise tree.error("the mechanism needs `file`: the name of a Cantera surface mechanism.")
    phase = text(fields["phase"], "the phase") if "phase" in fields else None
    bonds = [text(item, "a species") for item in items(fields["bonds"])] if "bonds" in fields else None
    return _with_suffix(text(fields["file"], "the mechanism")), phase, bonds


def _with_suffix(name: str) -> str:
    return name if Path(name).suffix in (".yaml", ".yml") else f"{name}.yaml"


def _find(name: str, base: Path, tree: Tree) -> Path:
    for folder in (base, data.mechanisms()):
        if document.is_file(folder / name):
            return folder / name
    known = [path.stem for folder in (data.mechanisms(),) for path in folder.glob("*.yaml")]
    raise tree.error(f"no mechanism {name} beside the case.{suggestion(Path(name).stem, known)}")

"""The mechanism that a case names: found beside the case or among those that come with the package."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from surfacechem.contracts.terms import Spec
from surfacechem.documents import document
from surfacechem.documents import shipped as data
from surfacechem.documents.document import Tree
from surfacechem.errors import suggestion
from surfacechem.format.fields import items, mapping, number, text

if TYPE_CHECKING:
    from surfacechem.mechanism import Mechanism
    from surfacechem.mechanism.neighbours import Neighbour

PRESSURE = Spec("Pa", "pressure", above=0)
FRACTION = Spec("1", "mole fraction", at_least=0, at_most=1)


def read_mechanism(tree: Tree | None, base: str, content: str | None, evaluate: bool) -> Mechanism | None:
    """The mechanism of a case, or None; ``content`` is its text where that is already at hand.

    With ``evaluate`` what is not lowered is left to Cantera.
    """
    if tree is None:
        return None
    named, phase, bonds, neighbours = _choice(tree)
    file = _with_suffix(text(named, "the mechanism"))
    if content is None:
        path = _find(file, Path(base), named)
        return _load(path, str(path), phase, bonds, tree, evaluate, neighbours)
    with TemporaryDirectory() as folder:
        path = Path(folder) / Path(file).name
        path.write_text(content, encoding="utf-8")
        return _load(path, file, phase, bonds, tree, evaluate, neighbours)


def _load(
    path: Path,
    name: str,
    phase: str | None,
    bonds: Sequence[str] | None,
    tree: Tree,
    evaluate: bool,
    beside: dict[str, Tree],
) -> Mechanism:
    from surfacechem.mechanism import load_mechanism

    neighbours = {name: _neighbour(child) for name, child in beside.items()}
    return load_mechanism(path, phase, bonds, tree.place, evaluate, neighbours, name)


def _neighbour(tree: Tree) -> Neighbour:
    """The state in which a phase beside the surface is held."""
    from surfacechem.mechanism.neighbours import Neighbour

    fields = mapping(tree, ["pressure", "composition", "electric-potential"])
    parts = mapping(fields.get("composition"))
    volts = fields.get("electric-potential")
    return Neighbour(
        number(fields["pressure"], "Pa", "pressure", PRESSURE) if "pressure" in fields else None,
        {name: number(child, "1", name, FRACTION) for name, child in parts.items()},
        number(volts, "V", "electric-potential") if volts is not None else 0.0,
        tree.place,
    )


def _choice(tree: Tree) -> tuple[Tree, str | None, Sequence[str] | None, dict[str, Tree]]:
    """File, phase, names of the bonds and states of the neighbours."""
    if not isinstance(tree.value, dict):
        return tree, None, None, {}
    fields = mapping(tree, ["file", "phase", "bonds", "neighbours"])
    if "file" not in fields:
        raise tree.error("the mechanism needs `file`: the name of a Cantera surface mechanism.")
    phase = text(fields["phase"], "the phase") if "phase" in fields else None
    bonds = [text(item, "a species") for item in items(fields["bonds"])] if "bonds" in fields else None
    return fields["file"], phase, bonds, mapping(fields.get("neighbours"))


def _with_suffix(name: str) -> str:
    return name if Path(name).suffix in (".yaml", ".yml") else f"{name}.yaml"


def _find(name: str, base: Path, tree: Tree) -> Path:
    """Beside the case, in the package, or where Cantera itself looks."""
    for folders in ((base, data.mechanisms()), _of_cantera()):
        for folder in folders:
            path = document.beside(folder, name, tree.place)
            if path is not None:
                return path
    known = [path.stem for path in data.mechanisms().glob("*.yaml")]
    raise tree.error(f"no mechanism {name} beside the case.{suggestion(Path(name).stem, known)}")


def _of_cantera() -> Iterator[Path]:
    """The folders in which Cantera itself looks for mechanisms."""
    import cantera

    yield from (Path(folder) for folder in cantera.get_data_directories() if folder != ".")

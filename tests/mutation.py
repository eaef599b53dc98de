"""Mutation test: one sign of a balance, of the assembly or of a law is changed, and a test has to fail.

    python tests/mutation.py [--factors] [--jobs N] [module ...]

Cosmic Ray makes the mutants: each + a -, each - a +, each leading - removed, and with ``--factors`` each * a / and each
/ a *. A mutant is loaded in a fork of a process that has the libraries and the compiled stepper ready; tests run there,
those that notice most first, until one fails. The exit code is 1 if a mutant survives that ``mutation_survivors.toml``
does not explain, and if one of those is noticed after all.
"""

import argparse
import contextlib
import io
import os
import signal
import sys
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path

ROOT = Path(__file__).parent.parent
FILES = {path.stem.removeprefix("test_"): path for path in (ROOT / "tests").rglob("test_*.py")}
EXPLAINED = Path(__file__).with_name("mutation_survivors.toml")
MODULES = ("surfacechem/model/balances.py", "surfacechem/model/*/*.py", "surfacechem/laws/*.py")
SIGNS = ("ReplaceBinaryOperator_Add_Sub", "ReplaceBinaryOperator_Sub_Add", "ReplaceUnaryOperator_Delete_USub")
FACTORS = ("ReplaceBinaryOperator_Mul_Div", "ReplaceBinaryOperator_Div_Mul")
LONGEST = 600
"""Seconds after which a mutant that hangs counts as noticed."""

OF_BALANCES = [
    ["balances"],
    ["zoo", "constraints", "heat_paths", "jumps", "pairs", "rate_and_state", "chemistry"],
    ["tables", "tables_bonds", "tables_mechanics"],
    ["start", "hybrid", "findings", "bad_input", "references_mechanics", "references_limits", "case"],
    ["rupture", "conduction"],
    ["fold", "breaking", "bound", "pulled", "media", "instant", "reactor", "evaluated"],
    ["unilateral", "plane", "load_path", "neighbours"],
]
OF_LAWS = [
    ["laws", "tabulated"],
    ["chemistry", "rate_and_state", "plane", "heat_paths"],
    ["tables_bonds", "tables_mechanics", "contact_laws", "media", "segments"],
]


@dataclass(frozen=True)
class Mutant:
    """One change of one module."""

    path: str
    operator: str
    line: int
    text: str
    code: str

    @property
    def module(self) -> str:
        return self.path.removesuffix(".py").replace("/", ".")

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.text}"


class Mutated(SourceFileLoader):
    """Loads a module from changed source."""

    def __init__(self, mutant: Mutant) -> None:
        super().__init__(mutant.module, str(ROOT / mutant.path))
        self.mutant = mutant

    def find_spec(self, name: str, *_rest: object) -> ModuleSpec | None:
        return spec_from_file_location(name, self.path, loader=self) if name == self.mutant.module else None

    def get_code(self, _name: str):
        return compile(self.mutant.code, self.path, "exec")


def mutants(path: str, operators: tuple[str, ...]) -> Iterator[Mutant]:
    """All mutants of a module by some operators."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    source = (ROOT / path).read_text()
    for name in operators:
        for occurrence in range(source.count("\n") * 20):
            code = mutate_code(source, get_operator(f"core/{name}")(), occurrence)
            if code is None:
                break
            pairs = zip(source.splitlines(), code.splitlines(), strict=True)
            line, text = next((i, after.strip()) for i, (before, after) in enumerate(pairs, 1) if before != after)
            yield Mutant(path, name, line, text, code)


def groups(path: str) -> list[list[str]]:
    """Tests of a module, by how much they notice for what they cost."""
    chosen = OF_LAWS if path.startswith("surfacechem/laws") else OF_BALANCES
    files = [[str(FILES[name]) for name in group] for group in chosen]
    return [[path, *files[0]], *files[1:]]


def prepare() -> None:
    """Import what every mutant shares, and nothing that may be mutated."""
    import hypothesis
    import mpmath
    import numba.core.compiler
    import pytest
    import scipy.integrate
    import scipy.optimize
    import xarray

    from surfacechem.solve.radau import stepper

    del hypothesis, mpmath, numba, pytest, scipy, xarray
    stepper.run_batch()
    assert "surfacechem.model.balances" not in sys.modules
    assert "surfacechem.laws" not in sys.modules


def noticed(mutant: Mutant) -> str:
    """The first test that fails on a mutant, or nothing."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.write(write, first_failure(mutant).encode())
        except BaseException as error:
            os.write(write, f"the tests end with {error!r}".encode())
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as answer:
        found = answer.read()
    status = os.waitpid(child, 0)[1]
    return found if status == 0 else f"ended by signal {status & 127}"


def first_failure(mutant: Mutant) -> str:
    """In the fork: the first test that fails."""
    import pytest

    class First:
        name = ""

        def pytest_collection(self) -> None:
            sys.meta_path.insert(0, Mutated(mutant))  # before pytest's own loader

        def pytest_exception_interact(self, node: pytest.Item) -> None:
            self.name = self.name or node.nodeid

    signal.alarm(LONGEST)
    first = First()
    quiet = ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    options = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", *quiet]
    for group in groups(mutant.path):
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            code = pytest.main([*options, *group], plugins=[first])
        if code not in (0, 5):
            return first.name or f"tests end with {code!r}"
    return ""


def explained() -> dict[tuple[str, str], str]:
    """Why a mutant may survive, by module and the line as it is mutated."""
    if not EXPLAINED.exists():
        return {}
    entries = tomllib.loads(EXPLAINED.read_text())["survivor"]
    return {(entry["module"], entry["mutant"]): entry["why"] for entry in entries}


def main() -> int:
    """Run all mutants, print what survives and count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--factors", action="store_true", help="mutate * and / too")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time")
    parser.add_argument("modules", nargs="*", help="files instead of all balances, assembly and laws")
    choice = parser.parse_args()
    os.chdir(ROOT)
    sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
    groups("surfacechem/laws"), groups("surfacechem/model")  # a test that is no more fails here, not as if it noticed
    prepare()
    paths = choice.modules or [str(path) for pattern in MODULES for path in Path().glob(pattern)]
    every = [m for path in sorted(paths) for m in mutants(path, SIGNS + FACTORS * choice.factors)]
    why, start, bad = explained(), time.perf_counter(), 0
    with ThreadPoolExecutor(choice.jobs) as pool:
        for mutant, found in zip(every, pool.map(noticed, every), strict=True):
            reason = why.get((mutant.path, mutant.text))
            bad += bool(found) == (reason is not None)
            print(f"{mutant}\n    {found or 'SURVIVES: ' + (reason or 'nothing noticed it')}", flush=True)
    print(f"{len(every)} mutants, {bad} not as they should be, {time.perf_counter() - start:.0f} s")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())

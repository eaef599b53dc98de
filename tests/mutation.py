"""Mutation test: one sign of a balance, of the assembly or of a law is changed, and a test has to fail.

    python tests/mutation.py [--factors] [--jobs N] [module ...]

Cosmic Ray makes the mutants: each + a -, each - a +, each leading - removed, and with ``--factors`` each * a / and each
/ a *. A mutant is loaded in a fork of a process that has the libraries and the compiled stepper ready; tests run there,
those that notice most first, until one fails. Only a test that fails counts: where the tests cannot be run this script
ends with an error, and without a mutant all of them have to be found. The exit code is 1 if a mutant survives that
``mutation_survivors.toml`` does not explain, and if one of those is noticed after all.
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
LONGEST = 300
"""Seconds after which a test fails that a mutant keeps busy; none takes a tenth of it without."""

OF_CASES = ["zoo::test_the_equations_of_a_case_keep_their_values"]
OF_BALANCES = [
    ["balances", "zoo::test_every_expression_keeps_its_approved_value", *OF_CASES],
    ["constraints", "unilateral", "bound", "closing", "pairs", "fold", "envelope", "chemistry", "jumps", "friction"],
    ["heat_paths", "force", "plane", "softening_friction", "breaking", "pulled", "area_stretch", "load_path", "media"],
    ["rate_and_state"],
    ["zoo::test_both_laws_of_thermodynamics_hold_on_the_equations", "zoo::test_a_case_gives_what_it_gave"],
    ["tables", "assemble", "start", "instant", "hybrid", "findings", "event_table"],
    ["references_mechanics", "references_limits", "bad_input", "case", "guards", "sweeps", "conduction"],
    ["reactor", "evaluated", "neighbours", "mechanism_scene", "stability", "cases"],
]
OF_LAWS = [
    ["laws", "tabulated", "contact_laws", "zoo::test_every_expression_keeps_its_approved_value", *OF_CASES],
    ["chemistry", "rate_and_state", "plane", "heat_paths", "media", "segments", "rates", "units", "bad_input"],
    ["tables", "zoo::test_a_case_gives_what_it_gave", "references_mechanics", "pulled"],
]
"""Files of tests, or one test of a file, by what they notice for what they cost; the first few seconds notice most."""


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
    """Tests of a module, by how much they notice for what they cost: those of its name come with the first."""
    chosen = OF_LAWS if path.startswith("surfacechem/laws") else OF_BALANCES
    own = [name for name in [Path(path).stem] if name in FILES and name not in chosen[0]]
    first, *rest = [[_test(name) for name in group] for group in [chosen[0] + own, *chosen[1:]]]
    return [[path, *first], *rest]


def _test(name: str) -> str:
    """A file of tests by its name, or one test of it."""
    file, _, test = name.partition("::")
    return f"{FILES[file]}::{test}" if test else str(FILES[file])


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
    stepper.LOOP.load()
    assert "surfacechem.model" not in sys.modules
    assert "surfacechem.laws" not in sys.modules


class HarnessError(Exception):
    """The tests could not be run."""


def noticed(mutant: Mutant | None, chosen: list[list[str]], *options: str) -> str:
    """The first test that fails on a mutant, or on the package as it is; nothing if none does."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        answer, status = "", 2
        try:
            answer, status = first_failure(mutant, chosen, *options), 0
        except BaseException as error:
            answer = repr(error)
        os.write(write, answer.encode())
        os._exit(status)
    os.close(write)
    with os.fdopen(read) as told:
        answer = told.read()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code:
        raise HarnessError(f"{mutant or 'without a mutant'}: the tests end with {code}: {answer or 'no answer'}")
    return answer


def killed_by(mutant: Mutant) -> str:
    """The first test of its module that fails on a mutant."""
    return noticed(mutant, groups(mutant.path))


def first_failure(mutant: Mutant | None, chosen: list[list[str]], *more: str) -> str:
    """In the fork: the first test that fails, or cannot even be imported, as it can be without the mutant."""
    import pytest

    class First:
        name = ""

        def pytest_collection(self) -> None:
            if mutant and not any(isinstance(finder, Mutated) for finder in sys.meta_path):
                assert mutant.module not in sys.modules, f"{mutant.module} is loaded before its mutant"
                sys.meta_path.insert(0, Mutated(mutant))  # before pytest's own loader

        def pytest_runtest_logstart(self) -> None:
            signal.alarm(LONGEST)

        def pytest_exception_interact(self, node: pytest.Item | pytest.Collector) -> None:
            self.name = self.name or node.nodeid

    def late(*_signal: object) -> None:
        raise TimeoutError(f"more than {LONGEST} s")

    signal.signal(signal.SIGALRM, late)
    first = First()
    quiet = ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    options = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", *quiet, *more]
    for group in chosen:
        with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(io.StringIO()):
            code = pytest.main([*options, *group], plugins=[first])
        if first.name:
            return first.name
        if code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            raise HarnessError(said.getvalue()[-1000:])
        if mutant:
            loader = getattr(sys.modules.get(mutant.module), "__loader__", None)
            assert isinstance(loader, Mutated), f"no test loads {mutant.module} as it is mutated"
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
    prepare()
    paths = choice.modules or [str(path) for pattern in MODULES for path in Path().glob(pattern)]
    every = [m for path in sorted(paths) for m in mutants(path, SIGNS + FACTORS * choice.factors)]
    tests = dict.fromkeys(test for path in paths for group in groups(path) for test in group)
    if missing := noticed(None, [[*tests]], "--collect-only"):
        raise HarnessError(f"{missing} cannot be imported without a mutant")
    why, start, bad = explained(), time.perf_counter(), 0
    with ThreadPoolExecutor(choice.jobs) as pool:
        for mutant, found in zip(every, pool.map(killed_by, every), strict=True):
            reason = why.get((mutant.path, mutant.text))
            bad += bool(found) == (reason is not None)
            print(f"{mutant}\n    {found or 'SURVIVES: ' + (reason or 'nothing noticed it')}", flush=True)
    print(f"{len(every)} mutants, {bad} not as they should be, {time.perf_counter() - start:.0f} s")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())

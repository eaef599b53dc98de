"""How many places one touches to add something: each addition is made in a copy of the package, and runs there.

A law, a rate type, an output, a component, a constraint and the solver of a library are one file each, a key of a case
is one line. So is an exact solution one file, in ``references/test_references_registry.py``.
"""

import json
import math
import os
import shutil
import subprocess
import sys
from typing import NamedTuple

import pytest
from test_docs import ROOT, blocks

pytestmark = pytest.mark.around

CASE = """\
T_0: 300 K
bodies:
  lower: {temperature: T, C: 50 J/m^2/K}
  upper: {temperature: T, C: 50 J/m^2/K}
interface: {temperature: T, friction: [coulomb: {mu: 0.25}]}
mechanics: {tangential: {m: 5 kg/m^2}}
loading: {p: 30 kPa}
initial: {T: 300 K, v: 2 m/s}
run: {until: 1 ms, solver: radau}
"""
RUN = """
import json, surfacechem
solution = surfacechem.run("case.yaml")
end = {column.name: float(column.values[-1]) for column in solution.columns if column.dimensions == ("time",)}
text = f"{solution.reason} {solution.audit.violations}"
print(json.dumps({**end, "text": text}))
"""
V_I, M, MU_P, T_I, C = 2.0, 5.0, 0.25 * 30e3, 300.0, 100.0

FACTOR = '''

class Steep(BondRates):
    """Twice the work of the force."""

    rate_types = (RateType("steep", "log_off", {"k_off": 1.0}, ("x",)),)

    k_off: float = parameter("1/s", "rate of rupture at no force")
    k_on: float = parameter("1/s", "rate of formation", default=0.0)
    x: float = parameter("m", "distance to the transition state")

    def log_off(self, f: Expression, T_c: Expression) -> Expression:
        """Logarithm of what the force does to rupture."""
        return 2 * f * self.x / (BOLTZMANN * T_c)
'''
RATE = """
import json
from surfacechem.mechanism import load_mechanism
(law,) = load_mechanism("bond.yaml").reactions
amounts = {"theta_free": 0.5, "n_theta_free": 1.0, "theta_bond": 0.5, "n_theta_bond": 1.0}
print(json.dumps({"rate": law.rate(T_c=300.0, f=1e-12, **amounts)}))
"""
BOND = """\
phases:
- {name: pair, thermo: ideal-surface, kinetics: surface, species: all, reactions: all, site-density: 1e-9 mol/m^2}
species:
- {name: free, composition: {}, thermo: {model: constant-cp}}
- {name: bond, composition: {}, thermo: {model: constant-cp}}
reactions:
- {equation: bond => free, type: steep, rate-constant: {A: 3 1/s, b: 0, Ea: 0}, x: 1 nm}
"""
COMPONENT = '''
"""A body that is cooled."""

from surfacechem.model.balances import HEAT, OUTSIDE, PowerFlow


def laws(build):
    """One statement of a power: balances, ledger and entropy follow."""
    body = build.scene.bodies[0].name
    T = build.thermal.node_of[body].T
    yield PowerFlow(HEAT, OUTSIDE, body, -1e6 + 0 * T, "H_cooled", "heat of cooling", entropy=-1e6 / T)
'''
CONSTRAINT = '''
"""The end of the track."""

from surfacechem.model.system import Margin


def jumps(build):
    """The slider stays on its track."""
    if build.scene.tangential:
        way = build.variables.get("u_t", "the track")
        yield Margin("track", 1.3e-3 - way, "the slider leaves its track")
'''
ADAPTER = '''
"""Dormand and Prince's method of order 8."""

from scipy.integrate import RK45

from surfacechem.solve.adapters.scipy_methods import SciPySolver


NAMES = ("rk45",)


def make(name: str) -> SciPySolver:
    """The solver of this name."""
    return SciPySolver(name, RK45)
'''


KEY = """    humidity: float = quantity("1", "relative humidity", 0.5, at_least=0, at_most=1)
"""
READ = """
import json
from surfacechem.documents.document import parse
from surfacechem.errors import InputError
from surfacechem.format.reader import read_document
from surfacechem.format.schema import schema
text = "bodies: {a: {temperature: T}, b: {temperature: T}}\\nsurroundings: {temperature: 300, HERE}\\nrun: {until: 1}"
found = {"default": schema()["properties"]["surroundings"]["properties"]["humidity"]["default"]}
found["given"] = read_document(parse(text.replace("HERE", "humidity: 40 percent"), "a.yaml"))[0].surroundings.humidity
try:
    read_document(parse(text.replace("HERE", "humdity: 1"), "a.yaml"))
except InputError as error:
    found["text"] = str(error)
print(json.dumps(found))
"""
MISSPELT = "a.yaml:2: surroundings: unknown key 'humdity'. Did you mean 'humidity'? Known: humidity, temperature."
SHOWN = {block.title: block.body for block in blocks(ROOT / "docs" / "adding-a-law.md") if block.title}
"""A law and a case that reads it, as the page on adding laws shows them."""

TOLD = """
import json
from typer.testing import CliRunner
from surfacechem.cli import app
commands = (["laws", "eyring"], ["equations", "case.yaml"])
print(json.dumps({command[0]: CliRunner().invoke(app, command).output for command in commands}))
"""


class Place(NamedTuple):
    """An addition: a file of the package, a line of it and the text to put behind, or '' and that to append; what
    becomes of the case; what it gives.
    """

    file: str
    after: str
    text: str
    case: str
    expected: dict[str, float | str]
    script: str = RUN


PLACES = {
    "a rate type": Place(
        "laws/kinetics.py", "", FACTOR, CASE, {"rate": 1.5 * math.exp(2e-12 * 1e-9 / (1.380649e-23 * 300.0))}, RATE
    ),
    "a law": Place(
        "laws/friction.py",
        "",
        "\n\n" + SHOWN["surfacechem/laws/friction.py"],
        SHOWN["eyring.yaml"],
        {"laws": "stress scale", "equations": "t_eyring = "},
        TOLD,
    ),
    "a key": Place(
        "format/sections.py",
        '"temperature of the surroundings", REQUIRED)\n',
        KEY,
        CASE,
        {"given": 0.4, "default": 0.5, "text": MISSPELT},
        READ,
    ),
    "an output": Place(
        "model/components/sliding_friction.py",
        "        yield PowerFlow(DISSIPATION, MECHANICS, INTERFACE, power, label)\n",
        '        build.name(Quantity("rubbed", "W/m^2", "power of friction"), power)\n',
        CASE,
        {"rubbed": MU_P * (V_I - MU_P / M * 1e-3)},
    ),
    "a component": Place(
        "model/components/cooling.py",
        "",
        COMPONENT,
        CASE.replace("v: 2 m/s", "v: 0 m/s"),
        {"H_cooled": -1e3, "T": T_I * math.sqrt(1 - 2e3 / (C * T_I)), "text": "()"},
    ),
    "a constraint": Place(
        "model/constraints/track.py",
        "",
        CONSTRAINT,
        CASE.replace("until: 1 ms", "until: 2 ms"),
        {"text": "the slider leaves its track"},
    ),
    "a solver": Place(
        "solve/adapters/explicit.py", "", ADAPTER, CASE.replace("radau", "rk45"), {"v": V_I - MU_P / M * 1e-3}
    ),
}


def test_places(tmp_path):
    """All additions in one copy of the package, each with a case of its own."""
    for folder in ("surfacechem", "cases", "mechanisms"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("*.pyc.*"))
    (tmp_path / "bond.yaml").write_text(BOND, encoding="utf-8")
    script = ""
    for number, place in enumerate(PLACES.values()):
        path = tmp_path / "surfacechem" / place.file
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        first, after, rest = before.partition(place.after) if place.after else (before, "", "")
        assert after == place.after
        path.write_text(first + after + place.text + rest, encoding="utf-8")
        (tmp_path / f"case{number}.yaml").write_text(place.case, encoding="utf-8")
        script += place.script.replace("case.yaml", f"case{number}.yaml")
    process, environment = [sys.executable, "-c", script], os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(process, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for (name, place), line in zip(PLACES.items(), done.stdout.splitlines(), strict=True):
        found = json.loads(line)
        for key, expected in place.expected.items():
            if isinstance(expected, str):
                assert expected in found[key], name
            else:
                assert found[key] == pytest.approx(expected, rel=1e-6), (name, found)

"""The command as a process: what it imports, how it ends, how it is interrupted."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from sampling import every

pytestmark = pytest.mark.around

HEAVY = ("xarray", "matplotlib", "CoolProp", "cantera", "sympy", "pandas", "dask", "sksundae")
LONG = """\
title: Rubbing for a very long time
T_0: 300 K
bodies:
  lower: {temperature: T, C: 1 MJ/m^2/K}
  upper: {temperature: T, C: 1 MJ/m^2/K}
interface:
  friction:
    - coulomb: {mu: 0.3}
loading:
  p: 1 kPa
  v: {harmonic: {amplitude: 1 mm/s, frequency: 100 1/s}}
initial: {T: 280 K}
run: {until: 100000 s, outputs: 2, max-steps: 1000000000}
"""

SOLVING = """\
from surfacechem.cli import app
from surfacechem.solve.run import Model

solve = Model.solve

def told(*arguments, **named):
    print("solving", flush=True)
    return solve(*arguments, **named)

Model.solve = told
app(["run", "long.yaml"], prog_name="surfacechem")
"""
"""The command line, saying when it has come to the solver."""


COMMAND = [sys.executable, "-m", "surfacechem"]


def surfacechem(*arguments, folder, **options):
    arguments = [*COMMAND, *arguments]
    return subprocess.run(arguments, cwd=folder, capture_output=True, text=True, timeout=300, check=False, **options)


def test_names_that_the_locale_cannot_encode(tmp_path):
    (folder := tmp_path / "prüfung").mkdir()
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0"}
    done = surfacechem("run", "exothermic", "-o", "wärme.nc", folder=folder, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    # A name on the command line arrives in the encoding of files; the others in the same process.
    repeat = "from surfacechem.cli.main import app; app(['rerun', *sys.argv[1:], '-o', 'again.nc'])"
    imported(folder, repeat, "app(['report', *sys.argv[1:]])", arguments=["wärme.nc"], env=environment)
    assert "wärme.nc" in (folder / "wärme.html").read_text(encoding="utf-8")


def imported(folder, *steps, arguments=(), **options):
    """Modules after each of the steps of one process, which says nothing of its own on the standard error."""
    guarded = "try:\n    {}\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
    script = "import sys\n" + "".join(f"{guarded.format(step)}print('modules', *sys.modules)\n" for step in steps)
    command = [sys.executable, "-c", script, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, **options)
    assert (done.returncode, done.stderr) == (0, "")
    return [set(line.split()) for line in done.stdout.splitlines() if line.startswith("modules ")]


@pytest.fixture(scope="module", autouse=True)
def first(tmp_path_factory):
    """A run as a process, after which the stepper is compiled."""
    return surfacechem("run", "exothermic", folder=tmp_path_factory.mktemp("first"))


def test_run_as_a_process(first):
    assert first.returncode == 0, first.stderr
    assert "exact solution exothermic-bonding" in first.stdout
    assert first.stderr == "" or first.stderr.startswith("compiling the stepper")


def test_commands_import_only_what_they_need(tmp_path):
    """What one step needs the next one finds, but needs no more than is allowed here."""
    start, reference, case, jumps, check, run, dataset = imported(
        tmp_path,
        "from surfacechem.cli.main import app",
        "from surfacechem.references import get; get('sliding')",
        "import surfacechem; surfacechem.load('exothermic')",
        "surfacechem.run('debonding')",
        "app(['check', 'sliding-dry'])",
        "app(['run', 'sliding-dry'])",
        "surfacechem.run('sliding-dry').dataset",
    )
    assert not start & {"numpy", "symengine", "numba", "netCDF4", "pint", "pydantic", "rich", "ruamel.yaml", *HEAVY}
    for room, step, files in (
        ("references", reference, {"base", "numerics", "sliding"}),
        ("laws", case, {"free_energy", "kinetics", "loading"}),
        ("surfaces", run, set()),
    ):
        assert {name for name in step if name.startswith(f"surfacechem.{room}.")} == {
            f"surfacechem.{room}.{file}" for file in files
        }
    assert "scipy" not in reference
    assert not jumps & {"numba", "scipy", "sksundae"}
    assert "numba" not in check
    assert (tmp_path / "sliding-dry.nc").exists()
    assert {"netCDF4", "symengine"} <= run
    assert not run & {"numba", "pint", "rich", "scipy.interpolate", "scipy.optimize", "scipy.special", *HEAVY}
    assert not dataset & {"dask.array", "pint"}
    (drawn,) = imported(tmp_path, "from surfacechem.cli.main import app; app(['plot', 'sliding-dry.nc'])")
    assert (tmp_path / "sliding-dry.png").exists()
    assert not drawn & {"surfacechem.format", "surfacechem.model", "surfacechem.solve", "symengine"}


@pytest.mark.parametrize("arguments", every(2, [(["run", "exothermic", "--set", "initial.T=0 K"],), (["run"],)]))
def test_bad_input_ends_without_traceback(tmp_path, arguments):
    done = surfacechem(*arguments, folder=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.strip()


WRITING = """\
import time
from surfacechem.results import netcdf
from surfacechem.cli import app

def slow(path, columns, attributes):
    path.write_bytes(b"half")
    print("writing", flush=True)
    while True:
        time.sleep(0.01)  # a signal that comes before one long sleep would wait for its end

netcdf.write_netcdf = slow
app(["run", "exothermic", "-q"], prog_name="surfacechem")
"""


def ended_by(number, script, told, folder, pause=0.0):
    """Exit code and outputs of a process that gets a signal once it has told something.

    A shell starts what runs in its background without interrupts, nohup without hang-ups, which this process then hands
    on.
    """
    own = signal.signal(number, signal.SIG_DFL)
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        signal.signal(number, own)
        try:
            assert process.stdout.readline() == told, process.communicate()
            time.sleep(pause)
            assert process.poll() is None, process.communicate()
            process.send_signal(number)
            return process.communicate(timeout=30), process.returncode
        finally:
            process.kill()


@pytest.mark.skipif(sys.platform == "win32", reason="no signals to one process")
@pytest.mark.parametrize(
    ("number", "words"), every(2, [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "ended by SIGTERM")])
)
def test_a_signal_ends_a_long_run_at_once_and_nothing_is_written(tmp_path, number, words):
    (tmp_path / "long.yaml").write_text(LONG)
    (out, error), code = ended_by(number, SOLVING, "solving\n", tmp_path, 0.3)  # well inside the compiled loop
    assert (code, out) == (128 + number, "")
    assert f"surfacechem: {words}; nothing was written.\n" in error
    assert "Traceback" not in error
    assert {path.name for path in tmp_path.iterdir()} == {"long.yaml"}


@pytest.mark.skipif(sys.platform == "win32", reason="no signals to one process")
def test_a_signal_while_writing_leaves_no_file_behind(tmp_path):
    _, code = ended_by(signal.SIGHUP, WRITING, "writing\n", tmp_path)
    assert code == 128 + signal.SIGHUP
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_standard_output_is_one_message(tmp_path):
    with open("/dev/full", "w") as full:
        done, silent = (
            subprocess.run([*COMMAND, "run", case], cwd=tmp_path, stdout=full, stderr=told, text=True, check=False)
            for case, told in (("exothermic", subprocess.PIPE), ("nowhere", full))
        )
    assert (done.returncode, silent.returncode) == (5, 2)
    assert done.stderr.splitlines()[-1] == "surfacechem: standard output: cannot be written: No space left on device."
    assert "Traceback" not in done.stderr

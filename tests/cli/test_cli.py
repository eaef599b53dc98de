"""Every command in-process: what it prints, what it writes, how it ends."""

import inspect
import json
import re
import signal
from importlib.metadata import version

import netCDF4
import numpy as np
import pytest
from typer.testing import CliRunner

from surfacechem import documents as data
from surfacechem.cli import commands
from surfacechem.cli.main import app
from surfacechem.laws import FAMILIES, laws
from surfacechem.runs import listing

pytestmark = pytest.mark.around

BONDING = """\
title: Bonding in contact
T_0: 300 K
bodies:
  lower: {temperature: T, C: 1 J/m^2/K}
  upper: {temperature: T, C: 1 J/m^2/K}
interface:
  temperature: T
  sites: 1e18 1/m^2
  potential:
    - bond-energy: {K_0: 300 J/m^2}
  bonding:
    - linear-affinity: {c_r: 6.7e15 1/J/s}
initial: {phi: 0, T: 300 K}
run: {until: 2.5 s, outputs: 26, accuracy: 1e-8}
"""
COOLING = """\
title: Cooling to zero
T_0: 300 K
bodies:
  lower: {temperature: T, C: 50 J/m^2/K}
  upper: {temperature: T, C: 50 J/m^2/K}
loading: {Q_1: -50 W/m^2}
initial: {T: 300 K}
run: {until: 400 s, outputs: 41}
"""


LAWS = [law for contract in FAMILIES for law in laws(contract).values()]


@pytest.fixture
def call(tmp_path, monkeypatch):
    """Run a command in an empty folder that holds two cases."""
    (tmp_path / "bonding.yaml").write_text(BONDING)
    (tmp_path / "cooling.yaml").write_text(COOLING)
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, [str(a) for a in arguments])


def files(folder):
    return {path.name for path in folder.iterdir()} - {"bonding.yaml", "cooling.yaml"}


RISING = "{ramp: {start: 300 K, rate: 1 K/s}}"
GIVEN = """
T_0: 300 K
bodies:
  lower: {temperature: 300 K}
  upper: {temperature: OTHER}
interface:
  temperature: 300 K
  sites: 1e18 1/m^2
  potential: [bond-energy: {K_0: 150 J/m^2}]
  bonding: [linear-affinity: {c_r: 1e16 1/J/s}]
initial: {phi: 0}
run: {until: 1 s}
"""


class TestRun:
    def test_writes_a_dataset_and_says_what_was_done(self, call, tmp_path):
        done = call("run", "bonding.yaml")
        assert done.exit_code == 0
        labels = ["solved", "finished", "error", "time", "balances", "written"]
        assert [line.split()[0] for line in done.stdout.splitlines()[1:]] == labels
        assert done.stdout.startswith("Bonding in contact\n")
        assert "phi, T; perfect contact; dop853 at rtol 1e-10" in done.stdout
        assert files(tmp_path) == {"bonding.nc"}

    def test_settings_and_changes_are_recorded(self, call):
        options = ["--solver", "lsoda", "--rtol", "1e-8", "--set", "initial.T=310 K", "--set", "run.outputs=5"]
        done = call("run", "bonding.yaml", *options, "-o", "x.nc", "-q")
        assert (done.exit_code, done.output) == (0, "")
        with netCDF4.Dataset("x.nc") as file:
            assert (file.solver, file.rtol, file["T"][0], len(file["T"])) == ("lsoda", 1e-8, 310.0, 5)
            assert "310 K" in file.case

    def test_stopped_by_physics_is_written_and_explained(self, call):
        done = call("run", "cooling.yaml")
        assert done.exit_code == 3
        assert "stopped    the temperature T reached zero" in done.stdout
        with netCDF4.Dataset("cooling.nc") as file:
            assert file.status == "stopped"
            assert file["time"][-1] <= 300.0
        done = call("run", "cooling.yaml", "--quiet")
        assert (done.exit_code, done.stdout) == (3, "")
        assert "reached zero" in done.stderr

    def test_numerical_failure_is_written_up_to_there(self, call):
        assert call("run", "bonding.yaml", "--set", "run.max-steps=2").exit_code == 4
        with netCDF4.Dataset("bonding.nc") as file:
            assert file.status == "failed"
            assert 0 < len(file["time"]) < 26

    def test_the_compile_is_announced(self, call, monkeypatch):
        from surfacechem.solve.radau import stepper

        monkeypatch.setattr(stepper.Loop, "is_compiled", False)
        assert "compiling the stepper, once" in call("run", "bonding.yaml").stderr
        assert call("run", "bonding.yaml", "-q").stderr == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "bondin.yaml"], "no file and no case 'bondin.yaml'"),
        (["run", "bonding.yaml", "--solver", "radua"], "no solver 'radua'. Did you mean 'radau'?"),
        (["run", "bonding.yaml", "--rtol", "2"], "--rtol: 2 is outside its range"),
        (["run", "bonding.yaml", "--rtol", "1e-20"], "--rtol: 1e-20 is outside its range: >= 1e-13"),
        (
            ["run", "bonding.yaml", "--accuracy", "1e-6", "--error", "balances"],
            "--error: the accuracy 1e-06 is verified by a second run, which `balances` leaves out: give a tolerance",
        ),
        (["run", "bonding.yaml", "--set", "initial.T=-1 K"], "outside its range"),
        (["run", "bonding.yaml", "--set", "initial.T=3 m"], "initial.T"),
        (["run", "bonding.yaml", "-o", "no/folder/x.nc"], "no/folder/x.nc: cannot be written"),
        (["run", "bonding.yaml", "-o", "."], "is a directory"),
        (
            ["run", "bonding.yaml", "-o", "x.txt"],
            "x.txt: no dataset is written as '.txt': .nc, .nc4, .cdf, .csv, .parquet.",
        ),
        (["run", "bonding.yaml", "-o", "s.zarr"], "Stores (.zarr) are for `sweep`."),
        (["run", "bonding.yaml", "-o", "bonding.yaml"], "no dataset is written as '.yaml'"),
        (["run", "loop.yaml"], "surfacechem: loop.yaml: is a link to loop.yaml, where no file is."),
        (
            ["sweep", "bonding.yaml", "--over", "initial.T=[300]", "-o", "x.txt"],
            "written as '.txt': .nc, .nc4, .cdf, .csv, .parquet. Give x.nc",
        ),
        (["sweep", "bonding.yaml", *["--over", "initial.T=[300]"] * 2], "initial.T: it is given twice."),
        (["equations", "bonding.yaml", "--format", "pyton"], "Did you mean 'python'?"),
        (["laws", "colomb"], "Did you mean 'coulomb'?"),
        (["laws", "friktion"], "Did you mean 'friction'?"),
        (["plot", "nothing.nc"], "there is no file nothing.nc."),
        (["plot", "bonding.yaml", "-o", "x.gif"], "no format 'gif'"),
        (["plot", "bonding.yaml", "-o", "no/x.png"], "no/x.png: cannot be written"),
        (["plot", "bonding.yaml", "--variables", "T,fi"], "no variable 'fi'"),
        (["plot", "run.csv"], "run.csv: is a table of numbers, which is for other programs. Write the run to run.nc"),
        (["report", "run.parquet"], "run.parquet: is a table of numbers"),
        (["rerun", "bonding.yaml"], "bonding.yaml: is not a readable netCDF dataset"),
        (["check", "bonding.yaml", "--set", "interface.potential.bond-energy.K_2=700 J/m^2"], "capacity at T was lost"),
    ],
)
def test_bad_input_is_one_message_and_nothing_is_written(call, tmp_path, arguments, message, monkeypatch):
    from surfacechem.runs.simulation import Simulation

    if "-o" in arguments:  # what cannot be written is not computed either
        monkeypatch.setattr(Simulation, "run", lambda *_, **__: pytest.fail("computed"))
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    done = call(*arguments)
    assert done.exit_code == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert files(tmp_path) == {"loop.yaml"}
    assert (tmp_path / "bonding.yaml").read_text() == BONDING


def test_what_is_read_is_not_written_over(call, tmp_path):
    (tmp_path / "points.csv").write_text("phi [1]\n0.5\n")
    (tmp_path / "case.nc").write_text(BONDING)
    assert call("run", "bonding.yaml", "-q").exit_code == 0
    kept = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for given in (
        ["evaluate", "bonding.yaml", "points.csv", "-o", "points.csv"],
        ["rerun", "bonding.nc", "-o", "bonding.nc"],
        ["run", "case.nc", "-o", "case.nc"],
        ["sweep", "case.nc", "--over", "initial.T=[300]", "-o", "case.nc"],
    ):
        done = call(*given)
        assert (done.exit_code, done.stderr) == (2, f"surfacechem: {given[-1]}: is what is read; give another file.\n")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == kept


class TestCheck:
    def test_says_the_scene_back(self, call):
        done = call("check", "bonding.yaml", "--set", "loading.p=1 kPa")
        assert done.exit_code == 0
        for words in ("perfect contact:", "T_c  merged", "phi  [1]  evolved", "bonding    linear-affinity"):
            assert words in done.stdout
        assert "Warnings\n  loading: p is prescribed but nothing reads it." in done.stdout

    def test_numbers(self, call):
        """phi' = c_r K_0 (1 - phi) / N_c relaxes in 1 / (c_r K_0 / N_c) = 0.4975 s."""
        text = call("check", "bonding.yaml").stdout
        assert re.search(r"t_fast +0.4975 s", text)
        assert re.search(r"stiffness +5.025", text)
        text = call("check", "bonding.yaml", "--set", "interface.potential.bond-energy.K_2=150 J/m^2").stdout
        values = dict(re.findall(r"^  (kappa_\d) +(\S+)", text, re.MULTILINE))
        assert float(values["kappa_0"]) == pytest.approx(300 / (2 * 300))
        assert float(values["kappa_2"]) == pytest.approx(150 / (2 * 300))
        assert "must be below 1: valid" in text

    @pytest.mark.parametrize(
        ("arguments", "told"),
        [
            (["dna-adhesive"], "all of the run"),
            (["cohesive-cycles"], "what follows at a transition is searched for in Python"),
            (["bonding.yaml", "--set", "run.solver=lsoda"], "lsoda is called from Python for every step"),
            (["bonding.yaml", "--set", "run.solver=cantera"], "asks Python for every right-hand side"),
        ],
    )
    def test_what_is_left_to_python(self, call, arguments, told):
        assert re.search(rf"^  compiled +.*{told}", call("check", *arguments).stdout, re.MULTILINE)

    def test_values_are_told_as_they_are_understood(self, call):
        """In SI, with their units: a bare 25 is no temperature of a room."""
        changes = ("--set", "loading.p=2 bar", "--set", "loading.Q_1=25")
        text = call("check", "bonding.yaml", *changes).stdout
        assert "Loads\n  p    hold  level = 200000 Pa\n  Q_1  hold  level = 25 W/m^2\nLaws\n" in text
        assert "  bonding    linear-affinity     c_r = 6.7e+15 1/(J s)\n" in text
        assert "  capacity   quadratic, 2 times  C = 1 J/(m^2 K)\n" in text

    def test_cells_that_a_run_finds_have_no_number_before_it(self, call):
        text = call("check", "epoxy-cure-thick").stdout
        assert "across laminate, in as many cells as an accuracy of 0.0001 takes\n" in text
        assert "across tool, in 4 cells\n" in text

    def test_how_a_sweep_steps_is_told(self, call):
        swept = ["sweep.over={initial.T_2: [300 K, 310 K]}", "sweep.keep={last: [T_c]}"]
        text = call("check", "dna-adhesive", *(part for change in swept for part in ("--set", change))).stdout
        told = "T_2 (300 to 310 K, 2 values); eight runs at once, by Radau IIA of order 9"
        assert f"{told}\n" in text
        assert "eight runs" not in call("check", "dna-adhesive").stdout
        spectrum = call("check", "force-spectroscopy").stdout
        rebinding = call(
            "check", "bond-constant-force", "--set", "sweep.over={interface.bonding.bell.k_on: [1 1/s, 2 1/s]}"
        )
        assert "  sweep      k_on (1 to 2 1/s, 2 values)\n" in rebinding.stdout, "of a parameter at its default"
        assert "  sweep      rate (0.1 to 100000 pN/s, 61 values), each until f = 2e-10 N\n" in spectrum

    def test_algebraic_rows_are_named(self, call, tmp_path):
        heat = "".join(f"  - conductance: {{between: [interface, {b}], h: 10 W/m^2/K}}\n" for b in ("lower", "upper"))
        bodies = BONDING.partition("interface:")[0].replace("T, C", "T_1, C", 1).replace("T, C", "T_2, C", 1)
        initial = "initial: {T_1: 300 K, T_2: 320 K}\nrun: {until: 2.5 s}\n"
        (tmp_path / "medium.yaml").write_text(f"{bodies}interface: {{temperature: T_c}}\nheat:\n{heat}{initial}")
        done = call("check", "medium.yaml")
        assert re.search(r"T_c +\[K\] +algebraic", done.stdout), done.output
        assert "separate interface temperature" in done.stdout

    @pytest.mark.parametrize(
        ("other", "regime"),
        [("300 K", "isothermal"), ("301 K", "prescribed temperatures"), (RISING, "prescribed temperatures")],
    )
    def test_given_temperatures_are_no_separate_one(self, call, other, regime, tmp_path):
        (tmp_path / "given.yaml").write_text(GIVEN.replace("OTHER", other))
        done = call("check", "given.yaml")
        assert re.search(rf"regime +{regime}: bodies and interface", done.stdout), done.output


def test_equations_run(call):
    done = call("equations", "bonding.yaml")
    module: dict = {}
    exec(done.stdout, module)
    balance_phi, balance_T = module["residual"](0.0, [0.0, 300.0], [6.7e15 * 300 / 1e18, 0.0])
    assert balance_phi == pytest.approx(0.0, abs=1e-15)
    assert balance_T == pytest.approx(-300 * 6.7e15 * 300 / 1e18)
    assert r"\begin{align*}" in call("equations", "bonding.yaml", "--format", "latex").stdout
    assert "  M = K_0 (φ - 1) " in call("equations", "bonding.yaml", "--format", "text").stdout


class TestListings:
    def test_every_law_is_listed_with_its_units_and_source(self, call):
        names = call("laws").stdout
        text = "".join(call("laws", contract.contract).stdout for contract in FAMILIES)
        assert text.count("Source: ") == len(LAWS)
        assert "not stated" not in text
        for law in LAWS:
            assert f"\n  {law.name()} " in names
            assert f"\n  {law.name()}\n" in text
        assert "mu [1]: sliding friction coefficient, >= 0" in text
        assert "\\" not in text

    def test_a_law_in_full(self, call):
        """Of the commands of a formula only names of functions and text stay words."""
        text = call("laws", "coulomb").stdout
        assert text.startswith("coulomb (friction)\n")
        assert "Amontons-Coulomb dry friction." in text
        for law in LAWS:
            text = listing.law_page(law.name())
            assert not re.search(r"\\|:math|\.\. math|[{}]", text.partition(">>>")[0]), text
            commands = set(re.findall(r"\\([A-Za-z]{2,})", inspect.getdoc(law) or ""))
            layout = "|".join(commands - {"ln", "exp", "sin", "cos", "tan", "min", "max", "sqrt"})
            formulas = " ".join(listing.formulas(law))
            assert not (layout and re.search(rf"(?<![A-Za-z])(?:{layout})(?![A-Za-z])", formulas)), formulas

    def test_schema_cases_and_version(self, call):
        assert json.loads(call("schema").stdout)["type"] == "object"
        lines = call("cases").stdout.splitlines()
        assert len(lines) == len(list(data.cases().glob("*.yaml")))
        assert any(re.match(r"exothermic +Exothermic bonding", line) for line in lines)
        assert call("--version").stdout == f"surfacechem {version('surfacechem')}\n"

    @pytest.mark.parametrize("command", [[], ["run"], ["rerun"]])
    def test_help_documents_exit_codes(self, call, command):
        text = call(*command, "--help").stdout
        assert "130  interrupted" in text
        assert "3    physics stopped the run" in text


def test_a_case_of_ones_own_begins_with_a_shipped_one(call, tmp_path):
    text = (data.cases() / "stick-slip.yaml").read_text()
    assert call("cases", "stick-slip").stdout == text
    assert call("new", "mine.yaml", "--from", "stick-slip").exit_code == 0
    assert (tmp_path / "mine.yaml").read_text() == text
    again = call("new", "mine.yaml")
    assert (again.exit_code, again.stderr) == (2, "surfacechem: mine.yaml: is there already; give another name.\n")
    assert (
        "no case 'stik-slip' comes with the package. Did you mean 'stick-slip'?"
        in call("new", "other.yaml", "--from", "stik-slip").stderr
    )
    swept = call("new", "bond.yaml", "--from", "catch-bond").stdout
    assert swept.endswith("`surfacechem run bond.yaml` or `surfacechem sweep bond.yaml`.\n")
    assert "a case is YAML: give other.yaml" in call("new", "other.txt").stderr


def test_shells_complete_cases_laws_and_paths(call, monkeypatch, capsys):
    assert commands.case_names("stick-slip-r") == ["stick-slip-rebonding"]
    assert commands.case_names("bond") == ["bond-constant-force", "bond-lifetimes", "bonding.yaml"]
    assert commands.law_names("coul") == ["coulomb"]
    for line in ("bonding.yaml", "bonding.yaml -q", "nowhere", ""):
        words = f"surfacechem run {line} --set initial.p".split()
        monkeypatch.setenv("COMP_WORDS", " ".join(words))
        monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
        monkeypatch.setenv("_SURFACECHEM_COMPLETE", "complete_bash")
        with pytest.raises(SystemExit):
            app(prog_name="surfacechem")
        assert capsys.readouterr().out.strip() == ("initial.phi=" if "bonding" in line else "")
    monkeypatch.delenv("_SURFACECHEM_COMPLETE")
    listed = re.findall(r"^  (\w+)", call("--help").stdout.partition("Commands:")[2], re.MULTILINE)
    assert listed[:4] == ["new", "cases", "laws", "check"]


class TestRerun:
    def test_is_the_same_to_the_last_bit(self, call):
        call("run", "bonding.yaml", "--solver", "lsoda", "--rtol", "1e-7", "--set", "initial.T=310 K")
        done = call("rerun", "bonding.nc", "-o", "again.nc")
        assert done.exit_code == 0, done.output
        assert "bit for bit the same" in done.stdout
        with netCDF4.Dataset("bonding.nc") as first, netCDF4.Dataset("again.nc") as second:
            assert set(first.variables) == set(second.variables)
            for name in first.variables:
                np.testing.assert_array_equal(first[name][...], second[name][...])

    def test_every_difference_is_told(self, call):
        call("run", "cooling.yaml")
        with netCDF4.Dataset("cooling.nc", "a") as file:
            file["T"][3] = np.nextafter(float(file["T"][3]), 1.0)
        done = call("rerun", "cooling.nc")
        assert (done.exit_code, done.stderr) == (1, "surfacechem: cooling.nc: 1 variables differ: T\n")
        with netCDF4.Dataset("cooling.nc", "a") as file:
            file.renameVariable("T", "Temp")
        assert "Temp, T" in call("rerun", "cooling.nc").stderr

    def test_a_file_of_others_is_refused(self, call):
        with netCDF4.Dataset("other.nc", "w"):
            pass
        done = call("rerun", "other.nc")
        assert done.exit_code == 2
        assert "other.nc: has no attribute 'case'" in done.stderr


class TestPlot:
    def test_of_a_dataset(self, call, tmp_path):
        call("run", "bonding.yaml")
        done = call("plot", "bonding.nc", "-o", "x.png")
        assert (done.exit_code, done.stdout) == (0, "x.png\n")
        content = (tmp_path / "x.png").read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) > 10_000

    def test_of_a_store_leaves_that_of_a_run_of_its_name(self, call, tmp_path):
        over = ["--over", "initial.T=[300, 310]", "--set", "sweep.checked=0"]
        assert call("sweep", "bonding.yaml", "-o", "bonding.zarr", "-q", *over).exit_code == 0
        told = [call("plot", name).stdout for name in ("bonding.yaml", "bonding.zarr")]
        assert told == ["bonding.png\n", "bonding-sweep.png\n"]
        assert {name for name in files(tmp_path) if name.endswith("png")} == {"bonding.png", "bonding-sweep.png"}

    def test_of_a_case_ends_like_the_run(self, call, tmp_path):
        assert call("plot", "cooling.yaml", "--set", "run.outputs=9", "--variables", "T").exit_code == 3
        assert files(tmp_path) == {"cooling.png"}


class TestVerbosity:
    def test_more_and_less_is_told(self, call):
        told = call("run", "bonding.yaml", "-v")
        assert "running" in told.stderr
        for heading in ("Errors", "Counts", "  steps"):
            assert f"\n{heading}" in told.stdout
        swept = call("sweep", "bonding.yaml", "--over", "initial.T=[300, 310]", "-v", "-o", "s.nc")
        assert "Runs\n  initial_T = 300 K  finished  error " in swept.stdout
        assert "  swept      initial_T (300 to 310 K, 2 values)\n" in swept.stdout


class TestSweep:
    def test_has_phase_portraits_and_is_not_mixed_with_runs(self, call, tmp_path):
        assert call("sweep", "bonding.yaml", "--over", "initial.T=[300, 310]", "-o", "s.nc", "-q").exit_code == 0
        drawn = call("plot", "s.nc", "--against", "phi", "-q")
        assert (drawn.exit_code, drawn.output) == (0, "")
        assert "no variable 'phy' along the runs" in call("plot", "s.nc", "--against", "phy").stderr
        assert "takes runs or sweeps, not both" in call("plot", "s.nc", "bonding.yaml").stderr
        assert files(tmp_path) == {"s.nc", "s-sweep.png"}

    def test_all_of_whose_runs_stop_is_stopped(self, call):
        done = call("sweep", "cooling.yaml", "--over", "initial.T=[280, 300]", "-o", "s.nc")
        assert done.exit_code == 3
        assert "2 runs: 2 stopped" in done.output
        assert call("sweep", "cooling.yaml", "--over", "initial.T=[300, 900]", "-o", "s.nc").exit_code == 0
        with netCDF4.Dataset("s.nc") as file:
            assert file.status == "finished"


@pytest.mark.parametrize("handler", [None, signal.SIG_IGN, signal.SIG_DFL, signal.default_int_handler])
def test_signals_are_handled_afterwards_as_before(monkeypatch, handler):
    """None stands for a handler that is not Python's: it cannot be put back, so that it is not replaced."""
    handlers = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: handler}
    before = dict(handlers)
    if hasattr(signal, "SIGHUP"):
        handlers[signal.SIGHUP] = before[signal.SIGHUP] = signal.SIG_DFL

    def install(number, new):
        assert new is not None
        handlers[number] = new

    monkeypatch.setattr(signal, "getsignal", handlers.get)
    monkeypatch.setattr(signal, "signal", install)
    with commands._signals_raised():
        kept = handler in (None, signal.SIG_IGN)
        assert handlers[signal.SIGTERM] == (handler if kept else commands._raise_signal)
        assert handlers[signal.SIGINT] == commands._raise_signal
    assert handlers == before

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

from surfacechem.cli import commands
from surfacechem.cli.main import app
from surfacechem.documents import shipped as data
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
        assert "phi, T; perfect contact; radau at rtol 1e-10" in done.stdout
        assert files(tmp_path) == {"bonding.nc"}

    def test_settings_of_the_command_line_are_recorded(self, call):
        assert call("run", "bonding.yaml", "--solver", "lsoda", "--rtol", "1e-8", "-o", "x.nc").exit_code == 0
        with netCDF4.Dataset("x.nc") as file:
            assert (file.solver, file.rtol) == ("lsoda", 1e-8)

    def test_set_changes_the_case_that_the_dataset_carries(self, call):
        assert call("run", "bonding.yaml", "--set", "initial.T=310 K", "--set", "run.outputs=5").exit_code == 0
        with netCDF4.Dataset("bonding.nc") as file:
            assert file["T"][0] == 310.0
            assert len(file["T"]) == 5
            assert "310 K" in file.case

    def test_quiet_prints_nothing(self, call):
        done = call("run", "bonding.yaml", "-q")
        assert (done.exit_code, done.output) == (0, "")

    def test_stopped_by_physics_is_written_and_explained(self, call):
        done = call("run", "cooling.yaml")
        assert done.exit_code == 3
        assert "stopped    the temperature T reached zero" in done.stdout
        with netCDF4.Dataset("cooling.nc") as file:
            assert file.status == "stopped"
            assert file["time"][-1] <= 300.0

    def test_stopped_by_physics_speaks_up_when_quiet(self, call):
        done = call("run", "cooling.yaml", "--quiet")
        assert (done.exit_code, done.stdout) == (3, "")
        assert "reached zero" in done.stderr

    def test_numerical_failure_is_written_up_to_there(self, call):
        done = call("run", "bonding.yaml", "--set", "run.max-steps=2")
        assert done.exit_code == 4
        with netCDF4.Dataset("bonding.nc") as file:
            assert file.status == "failed"
            assert 0 < len(file["time"]) < 26

    def test_the_compile_is_announced(self, call, monkeypatch):
        from surfacechem.solve.radau import stepper

        monkeypatch.setattr(stepper, "is_compiled", lambda: False)
        assert "compiling the stepper, once" in call("run", "bonding.yaml").stderr
        assert call("run", "bonding.yaml", "-q").stderr == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "bondin.yaml"], "no file and no case 'bondin.yaml'"),
        (["run", "bonding.yaml", "--solver", "radua"], "no solver 'radua'. Did you mean 'radau'?"),
        (["run", "bonding.yaml", "--rtol", "2"], "--rtol: 2 is outside its range"),
        (["run", "bonding.yaml", "--set", "initial.T=-1 K"], "outside its range"),
        (["run", "bonding.yaml", "--set", "initial.T=3 m"], "initial.T"),
        (["run", "bonding.yaml", "-o", "no/folder/x.nc"], "no/folder/x.nc: cannot be written"),
        (["run", "bonding.yaml", "-o", "."], "is a directory"),
        (["equations", "bonding.yaml", "--format", "pyton"], "Did you mean 'python'?"),
        (["laws", "colomb"], "Did you mean 'coulomb'?"),
        (["plot", "nothing.nc"], "nothing.nc: is not a readable netCDF dataset"),
        (["plot", "bonding.yaml", "-o", "x.gif"], "no format 'gif'"),
        (["plot", "bonding.yaml", "--variables", "T,fi"], "no variable 'fi'"),
        (["rerun", "bonding.yaml"], "bonding.yaml: is not a readable netCDF dataset"),
        (["check", "bonding.yaml", "--set", "interface.potential.bond-energy.K_2=700 J/m^2"], "capacity at T was lost"),
    ],
)
def test_bad_input_is_one_message_and_nothing_is_written(call, tmp_path, arguments, message):
    done = call(*arguments)
    assert done.exit_code == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert files(tmp_path) == set()


def test_unwritable_output_is_refused_before_computing(call, monkeypatch):
    from surfacechem.runs.simulation import Simulation

    monkeypatch.setattr(Simulation, "run", lambda *_, **__: pytest.fail("computed"))
    assert call("run", "bonding.yaml", "-o", "no/x.nc").exit_code == 2
    assert call("plot", "bonding.yaml", "-o", "no/x.png").exit_code == 2


class TestCheck:
    def test_says_the_scene_back(self, call):
        done = call("check", "bonding.yaml")
        assert done.exit_code == 0
        for words in ("perfect contact:", "T_c  merged", "phi  [1]  evolved", "bonding    linear-affinity"):
            assert words in done.stdout

    def test_numbers(self, call):
        done = call("check", "bonding.yaml", "--set", "interface.potential.bond-energy.K_2=150 J/m^2")
        values = dict(re.findall(r"^  (kappa_\d|t_fast|stiffness) +(\S+)", done.stdout, re.MULTILINE))
        assert float(values["kappa_0"]) == pytest.approx(300 / (2 * 300))
        assert float(values["kappa_2"]) == pytest.approx(150 / (2 * 300))
        assert "must be below 1: valid" in done.stdout

    def test_time_scales_are_those_of_the_equations(self, call):
        """phi' = c_r K_0 (1 - phi) / N_c relaxes in 1 / (c_r K_0 / N_c) = 0.4975 s."""
        done = call("check", "bonding.yaml")
        assert re.search(r"t_fast +0.4975 s", done.stdout)
        assert re.search(r"stiffness +5.025", done.stdout)

    def test_algebraic_rows_are_named(self, call):
        text = (
            BONDING.replace("temperature: T, C", "temperature: T_k, C").replace("T_k", "T_1", 1).replace("T_k", "T_2")
        )
        text = re.sub(r"interface:.*?(?=initial)", "interface: {temperature: T_c}\n", text, flags=re.DOTALL)
        heat = "".join(f"  - conductance: {{between: [interface, {b}], h: 10 W/m^2/K}}\n" for b in ("lower", "upper"))
        text = text.replace("initial: {phi: 0, T: 300 K}", f"heat:\n{heat}initial: {{T_1: 300 K, T_2: 320 K}}")
        with open("medium.yaml", "w") as file:
            file.write(text)
        done = call("check", "medium.yaml")
        assert re.search(r"T_c +\[K\] +algebraic", done.stdout), done.output
        assert "separate interface temperature" in done.stdout

    @pytest.mark.parametrize(
        ("other", "regime"),
        [("300 K", "isothermal"), ("301 K", "prescribed temperatures"), (RISING, "prescribed temperatures")],
    )
    def test_given_temperatures_are_no_separate_one(self, call, other, regime):
        with open("given.yaml", "w") as file:
            file.write(GIVEN.replace("OTHER", other))
        done = call("check", "given.yaml")
        assert re.search(rf"regime +{regime}: bodies and interface", done.stdout), done.output

    def test_what_has_no_effect_is_a_warning(self, call):
        done = call("check", "bonding.yaml", "--set", "loading.p=1 kPa")
        assert "Warnings\n  loading: p is prescribed but nothing reads it." in done.stdout


def test_equations_run(call):
    done = call("equations", "bonding.yaml")
    module: dict = {}
    exec(done.stdout, module)
    balance_phi, balance_T = module["residual"](0.0, [0.0, 300.0], [6.7e15 * 300 / 1e18, 0.0])
    assert balance_phi == pytest.approx(0.0, abs=1e-15)
    assert balance_T == pytest.approx(-300 * 6.7e15 * 300 / 1e18)
    assert r"\begin{align*}" in call("equations", "bonding.yaml", "--format", "latex").stdout


class TestListings:
    def test_every_law_is_listed_with_its_units_and_source(self, call):
        from surfacechem.laws import FAMILIES, laws

        text = call("laws").stdout
        every = [law for contract in FAMILIES for law in laws(contract).values()]
        assert text.count("Source: ") == len(every)
        assert "not stated" not in text
        for law in every:
            assert f"\n  {law.name()}\n" in text
        assert "mu [1]: sliding friction coefficient, >= 0" in text
        assert "\\" not in text

    def test_a_law_in_full(self, call):
        text = call("laws", "coulomb").stdout
        assert text.startswith("coulomb (friction)\n")
        assert "Amontons-Coulomb dry friction." in text
        assert "mu [1]: sliding friction coefficient, >= 0" in text

    def test_formulas_have_no_words_of_latex(self, call):
        """Of the commands of a formula only names of functions and text stay words."""
        from surfacechem.laws import FAMILIES, laws

        for law in (law for contract in FAMILIES for law in laws(contract).values()):
            text = call("laws", law.name()).stdout
            assert not re.search(r"\\|:math|\.\. math|[{}]", text.partition(">>>")[0]), text
            commands = set(re.findall(r"\\([A-Za-z]{2,})", inspect.getdoc(law) or ""))
            layout = "|".join(commands - {"ln", "exp", "sin", "cos", "min", "max", "sqrt"})
            formulas = " ".join(listing.formulas(law))
            assert not (layout and re.search(rf"(?<![A-Za-z])(?:{layout})(?![A-Za-z])", formulas)), formulas

    def test_schema_is_json(self, call):
        assert json.loads(call("schema").stdout)["type"] == "object"

    def test_cases_have_titles(self, call):
        from surfacechem.documents.shipped import cases

        lines = call("cases").stdout.splitlines()
        assert len(lines) == len(list(cases().glob("*.yaml")))
        assert any(re.match(r"exothermic +Exothermic bonding", line) for line in lines)

    def test_version(self, call):
        assert call("--version").stdout == f"surfacechem {version('surfacechem')}\n"

    @pytest.mark.parametrize("command", [[], ["run"], ["rerun"]])
    def test_help_documents_exit_codes(self, call, command):
        text = call(*command, "--help").stdout
        assert "130  interrupted" in text
        assert "3    the run was stopped by physics" in text


class TestRerun:
    @pytest.mark.parametrize("options", [[], ["--solver", "lsoda", "--rtol", "1e-7"], ["--set", "initial.T=310 K"]])
    def test_is_the_same_to_the_last_bit(self, call, options):
        call("run", "bonding.yaml", *options)
        done = call("rerun", "bonding.nc", "-o", "again.nc")
        assert done.exit_code == 0, done.output
        assert "bit for bit the same" in done.stdout
        with netCDF4.Dataset("bonding.nc") as first, netCDF4.Dataset("again.nc") as second:
            assert set(first.variables) == set(second.variables)
            for name in first.variables:
                np.testing.assert_array_equal(first[name][...], second[name][...])

    def test_of_a_stopped_run_is_the_same(self, call):
        call("run", "cooling.yaml")
        assert call("rerun", "cooling.nc").exit_code == 0

    def test_one_bit_is_a_difference(self, call):
        call("run", "bonding.yaml")
        with netCDF4.Dataset("bonding.nc", "a") as file:
            file["phi"][3] = np.nextafter(float(file["phi"][3]), 1.0)
        done = call("rerun", "bonding.nc")
        assert done.exit_code == 1
        assert done.stderr == "surfacechem: bonding.nc: 1 variables differ: phi\n"

    def test_missing_variables_and_other_shapes_are_differences(self, call):
        call("run", "bonding.yaml")
        with netCDF4.Dataset("bonding.nc", "a") as file:
            file.renameVariable("phi", "fi")
        assert "fi, phi" in call("rerun", "bonding.nc").stderr

    def test_a_file_of_others_is_refused(self, call):
        with netCDF4.Dataset("other.nc", "w"):
            pass
        done = call("rerun", "other.nc")
        assert done.exit_code == 2
        assert "other.nc: has no attribute 'case'" in done.stderr


class TestPlot:
    @pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
    def test_of_a_dataset(self, call, tmp_path, kind):
        call("run", "bonding.yaml")
        done = call("plot", "bonding.nc", "-o", f"x.{kind}")
        assert (done.exit_code, done.stdout) == (0, f"x.{kind}\n")
        start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[kind]
        content = (tmp_path / f"x.{kind}").read_bytes()
        assert content.startswith(start)
        assert len(content) > 10_000

    def test_of_a_case(self, call, tmp_path):
        assert call("plot", "bonding.yaml", "--set", "run.outputs=9", "--variables", "T, phi").exit_code == 0
        assert files(tmp_path) == {"bonding.png"}

    def test_of_a_stopped_case_ends_like_the_run(self, call, tmp_path):
        assert call("plot", "cooling.yaml").exit_code == 3
        assert files(tmp_path) == {"cooling.png"}


def test_a_case_is_not_overwritten_by_its_own_dataset(call, tmp_path):
    case = tmp_path / "mine.yaml"
    case.write_text((data.cases() / "exothermic.yaml").read_text())
    result = call("run", case, "-o", case)
    assert result.exit_code == 2
    assert "is the case itself" in result.stderr
    assert case.read_text().startswith("title")


def test_a_link_that_leads_nowhere_is_called_that(call, tmp_path):
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    done = call("run", "loop.yaml")
    assert done.exit_code == 2
    assert done.stderr == "surfacechem: loop.yaml: is a link to loop.yaml, where no file is.\n"


@pytest.mark.parametrize("command", [("run", "bonding.yaml"), ("sweep", "bonding.yaml", "--over", "initial.T=[300]")])
def test_other_formats_than_netcdf_are_refused(call, tmp_path, command):
    done = call(*command, "-o", "x.csv")
    assert done.exit_code == 2
    assert "x.csv: datasets are written as netCDF, not as '.csv': .nc, .nc4, .cdf. Give x.nc" in done.stderr
    assert files(tmp_path) == set()


def test_a_sweep_has_no_other_axis(call, tmp_path):
    assert call("sweep", "bonding.yaml", "--over", "initial.T=[300, 310]", "-o", "s.nc", "-q").exit_code == 0
    done = call("plot", "s.nc", "--against", "phi")
    assert done.exit_code == 2
    assert "--against: a sweep is plotted over what it sweeps" in done.stderr
    assert files(tmp_path) == {"s.nc"}


def test_a_sweep_all_of_whose_runs_stop_is_stopped(call):
    done = call("sweep", "cooling.yaml", "--over", "initial.T=[280, 300]", "-o", "s.nc")
    assert done.exit_code == 3
    assert "2 runs: 2 stopped" in done.output
    some = call("sweep", "cooling.yaml", "--over", "initial.T=[300, 900]", "-o", "s.nc")
    assert some.exit_code == 0
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
        assert handlers[signal.SIGTERM] == (handler if kept else commands._end)
        assert handlers[signal.SIGINT] == commands._end
    assert handlers == before

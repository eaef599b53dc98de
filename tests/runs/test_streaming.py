"""Sweeps into a store: each run as by itself; the same bytes however it was computed, interrupted and gone on with."""

import csv
import hashlib
import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import xarray
from random_scenes import random_scene
from sampling import every
from typer.testing import CliRunner

import surfacechem
from surfacechem.cli.main import app
from surfacechem.errors import InputError, OutputError
from surfacechem.results import store
from surfacechem.results.store import Layout, StoredArray, opened
from surfacechem.runs import arrays, checking, streaming
from surfacechem.runs.checking import check
from surfacechem.runs.keeping import STATUSES, Keep, extremes
from surfacechem.runs.summaries import store_summary
from surfacechem.solve.run import Run
from surfacechem.tolerances import LINE_ERROR

pytestmark = pytest.mark.around

K_0 = "interface.potential.bond-energy.K_0"
ENDS = {"last": ["T", "phi"]}
SIZES = "EXPLICIT_RUNS", "IMPLICIT_RUNS", "JUMPING_RUNS"


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    for name in SIZES:
        monkeypatch.setattr(streaming, name, 16)


def case(name="exothermic", keep=None, over=None, **more):
    over = over or {K_0: {"from": 100, "to": 300, "points": 60}}
    solver = {"run.solver": more.pop("solver")} if "solver" in more else {}
    return surfacechem.load(name, {"sweep": {"over": over, **({"keep": keep} if keep else {}), **more}, **solver})


def begun(simulation, path, **given):
    return simulation.stream(simulation.plan(), path, **given)


def stored(path, simulation=None, **options):
    given = {name: options.pop(name) for name in ("changes", "resume", "part") if name in options}
    return begun(simulation or case(keep=ENDS), path, **given).run(options.pop("threads", 1), **options)


@pytest.mark.parametrize("balances", ["none", "all"])
def test_a_run_too_stiff_for_the_method_of_its_case_goes_by_implicit_steps(tmp_path, balances):
    keep, cold = {"last": ["theta_free_s"], "balances": balances}, "interface.temperature"
    found = stored(tmp_path / "s.zarr", case("vinculin-catch-bond", keep=keep, over={cold: [298.15, 3.0]})).dataset
    assert found["status"].values.tolist() == [STATUSES.index("finished")] * 2
    assert float(found["theta_free_s_last"][1]) == pytest.approx(1.0)  # at 3 K and 8 pN bonds break at once


def digest(path):
    return {f.relative_to(path): hashlib.sha256(f.read_bytes()).hexdigest() for f in path.rglob("*") if f.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A store that was written at once, by one thread."""
    path = tmp_path_factory.mktemp("whole") / "o.zarr"
    with pytest.MonkeyPatch.context() as patch:
        for name in SIZES:
            patch.setattr(streaming, name, 16)
        stored(path)
    return path


X_OFF = "interface.bonding.bell.x_off"

SWEPT = {
    "exothermic": {K_0: [100.0, 300.0], "initial.phi": [0.0, 0.2, 0.4]},
    "shared-load-rupture": {"loading.t_n": [200.0, 517.743, 1000.0]},
    "debonding": {"interface.limits.tensile-strength.t_max": ["20 MPa", "1 GPa"]},
    "compliant-debonding": {"interface.bonding.compliant-debonding.t_max": [7e7, 8e7]},
    "stick-slip": {"interface.friction.coulomb.mu_s": [0.6, 0.7]},
    "cooling-to-zero": {"initial.T": [300.0, 310.0]},
    "catch-bond": {"loading.f": [1e-11, 2e-11]},
}


KEPT = {"last": "all", "max": "all", "min": "all", "events": "all"}


@pytest.fixture(scope="module")
def streams(tmp_path_factory):
    """The sweep of a case, stored once: by the solver that is named, by steps that suit the scene, without balances."""

    @cache
    def stream(name, way):
        keep = KEPT | ({"balances": "none"} if way == "bare" else {})
        simulation = case(name, keep, SWEPT[name], **({"solver": "radau"} if way == "named" else {}))
        made = begun(simulation, tmp_path_factory.mktemp(way) / "o.zarr")
        made.run(1)
        return made

    return stream


@pytest.mark.parametrize("name", every(2, SWEPT))
def test_what_is_kept_of_a_run_is_that_of_the_run_by_itself(name, streams):
    stream = streams(name, "named")
    simulation, data = stream.chunks.simulation, stream.store.dataset
    for i, point in enumerate(stream.chunks.plan.points):
        one = {key: values.values.ravel()[i] for key, values in data.data_vars.items()}
        alone = simulation.run(point, replace(simulation.case.run, picture=None))
        run = alone.trajectory
        assert STATUSES[one["status"]] == run.status
        assert run.reason.startswith(data.attrs["reasons"][one["reason"]])
        assert (one["time_reached"], one["steps"]) == (run.result.t, run.result.counters.steps)
        for balance in ("energy_error", "entropy_error", "site_error"):
            assert one[balance] == pytest.approx(alone.attributes[balance], rel=1e-9, abs=1e-15)
        for key in data.data_vars:
            variable, _, which = key.rpartition("_")
            if which in ("max", "min"):
                assert one[key] == extremes(run)[which][variable]
            if which == "last" and variable in run.model.system.state_columns:
                assert one[key] == run.result.y[run.model.system.state_columns[variable]]
        events = alone.dataset["event_name"].values if "event_name" in alone.dataset else ()
        for name in dict.fromkeys(events):  # the first of each
            event = alone.dataset["event_time"].values[list(events).index(name)]
            assert event in [one["time_reached"], *(one[key] for key in one if key.startswith("time_"))]


@pytest.mark.parametrize("name", every(2, SWEPT))
def test_the_method_that_suits_the_scene_keeps_the_same_values(name, streams):
    named, suited = (streams(name, way) for way in ("named", "suited"))
    wanted, found = named.store.dataset, suited.store.dataset
    for key in ["status", "reason", "time_reached", *(key for key in wanted if key.startswith("time_"))]:
        np.testing.assert_allclose(found[key].values, wanted[key].values, rtol=1e-8, err_msg=key)
    # At a rupture a state changes by much in the last digit of the time.
    for state in (state.name for state in named.chunks.model.system.states if "rupture" not in name):
        size = np.abs(wanted[f"{state}_max"].values).max()
        np.testing.assert_allclose(found[f"{state}_last"], wanted[f"{state}_last"], atol=1e-8 * size, err_msg=state)
    for balance in ("energy_error", "entropy_error", "site_error"):
        assert np.all(found[balance] < 1e-9)


@pytest.mark.parametrize("name", every(2, SWEPT))
def test_without_balances_the_rest_is_the_same(name, streams):
    stream = streams(name, "bare")
    assert stream.chunks.model.program.ledger is None
    found, wanted = stream.store.dataset, streams(name, "suited").store.dataset
    assert set(wanted) - set(found) == {"energy_error", "entropy_error", "site_error"}
    for key in (key for key in found if key not in ("steps", "reason") and not key.endswith(("_max", "_min"))):
        # At a rupture a state changes by much in the last digit of the time.
        size = np.nanmax(np.abs(wanted[key].values), initial=0.0)
        np.testing.assert_allclose(found[key].values, wanted[key].values, rtol=1e-7, atol=1e-7 * size, err_msg=key)
    checked = check(stream)  # by runs that have theirs; extremes lie between outputs and steps
    assert np.all(checked.error < (LINE_ERROR if stream.chunks.model.system.edges else 1e-5)), str(checked)
    for words in ("balances   not kept", f"{getattr(stream.chunks.lanes, 'words', '')} at rtol"):
        assert words in str(store_summary(stream, stream.store, checked)[1])


def test_times_of_values_and_states_at_events(tmp_path):
    keep = {"reach": {"phi": 0.5, "T": "310 K"}, "series": ["T"]}
    simulation = case(keep=keep, over={K_0: [300.0, 30.0]})
    data = stored(tmp_path / "o.zarr", simulation).dataset
    written, group = digest(tmp_path), store._zarr().open_group(tmp_path / "o.zarr", mode="r+")
    group["T"][...], group["time_to_T"][...] = group["T"][...], group["time_to_T"][...]
    assert digest(tmp_path) == written  # files are those that Zarr writes
    times = tuple(data["time"].values)
    assert 50 < len(times) < 201  # outputs follow the runs
    alone = simulation.run({K_0: 300.0}, replace(simulation.case.run, picture=None, times=times))
    np.testing.assert_allclose(data["T"].values[0], alone.dataset["T"].values, rtol=1e-9)  # its steps end elsewhere
    for name, value in (("phi", 0.5), ("T", 310.0)):
        t = data[f"time_to_{name}"].values[0]
        ended = surfacechem.run("exothermic", {"run.until": t}).dataset
        assert ended[name].values[-1] == pytest.approx(value, rel=1e-9)
    assert np.isnan(data["time_to_T"].values[1])
    simulation = case("debonding", {"events": "all", "at-events": ["phi"]}, SWEPT["debonding"])
    data = stored(tmp_path / "d.zarr", simulation).dataset
    assert data["time_debond"].values[0] > 0
    assert data["phi_at_debond"].values[0] > 0
    assert np.isnan(data["time_debond"].values[1])


@pytest.mark.parametrize(
    ("name", "path", "keep", "level"),
    [
        ("debonding", K_0, {"reach": {"T": 320}, "max": ["T"]}, "T"),
        ("cohesive-pull-off", "initial.T", {"reach": {"g_n": 5e-8}, "max": ["g_n"]}, "g_n"),
        ("bouncing-plate", "mechanics.normal.e", {"reach": {"v_n": 1}, "max": ["v_n"]}, "v_n"),
    ],
)
def test_levels_and_extremes_are_met_in_jumps_too(name, path, keep, level, tmp_path):
    """Both in arrays and one run at a time: the jump carries the quantity across the level, to its largest value."""
    given = {K_0: [100.0], "initial.T": [300.0], "mechanics.normal.e": [0.7]}[path]
    found = stored(tmp_path / "s.zarr", case(name, keep=keep, over={path: given})).dataset
    run = surfacechem.load(name).run({path: given[0]}).trajectory
    (jump,) = (j for j in run.jumps if j.t == found[f"time_to_{level}"].item())
    j = run.model.system.state_columns[level]
    assert jump.before.y[j] < keep["reach"][level] <= jump.after.y[j]
    assert found[f"{level}_max"].item() >= (1 - 1e-9) * jump.after.y[j]


@pytest.mark.parametrize("more", [{}, {"run.max-seconds": 1000}])
def test_a_run_that_begins_at_a_value_has_reached_it(more, tmp_path):
    """In arrays and one run at a time; one that begins beyond it has not come to it."""
    keep, over = {"reach": {"phi": 0.5, "T": "26.85 degC"}, "balances": "none"}, {"initial.phi": [0.1, 0.5, 0.7]}
    simulation = surfacechem.load("exothermic", {"sweep": {"over": over, "keep": keep}, **more})
    found = stored(tmp_path / "s.zarr", simulation).dataset
    assert found["time_to_T"].values.tolist() == [0.0, 0.0, 0.0]
    assert found["time_to_phi"].values[1:].tolist() == pytest.approx([0.0, np.nan], nan_ok=True)
    assert 0 < found["time_to_phi"].values[0] < 1


STEPPED = """
T_0: 300 K
bodies:
  lower: {temperature: T, capacity: constant, C: 2 kJ/m^2/K}
  upper: {temperature: T, capacity: constant, C: 2 kJ/m^2/K}
interface: {temperature: T, friction: [coulomb: {mu: 0.3}]}
loading: {p: 100 kPa, v: {table: {times: [0 s, 4 s, 4 s, 5 s, 9 s], values: %s}}}
initial: {T: 300 K}
run: {until: 9 s}
"""


@pytest.mark.parametrize("after", [1000, 1])
def test_levels_and_extremes_are_met_where_loads_step_too(after, tmp_path):
    """In arrays, one run at a time, and at the times that runs share, which lie on both sides of the step."""
    text = STEPPED % [f"{v} mm/s" for v in (1, 1, 1000, after, after)]
    over = {"interface.friction.coulomb.mu": [0.1, 0.3]}
    for k, more in enumerate(({}, {"run.max-seconds": 1000})):
        keep = {"max": ["v", "D_coulomb"], "reach": {"v": "0.5 m/s"}}
        simulation = surfacechem.load(text, {"sweep": {"over": over, "keep": keep}, **more})
        found = stored(tmp_path / f"{k}.zarr", simulation).dataset
        np.testing.assert_allclose(found["D_coulomb_max"], [1e4, 3e4], rtol=1e-12)
        assert (found["v_max"].values.tolist(), found["time_to_v"].values.tolist()) == ([1.0, 1.0], [4.0, 4.0])
    shared = surfacechem.load(text).sweep(over).dataset
    assert shared["v"].sel(time=[4.0, np.nextafter(4.0, 5.0)]).values[0] == pytest.approx([1e-3, 1.0])
    assert shared["v_max"].values.tolist() == [1.0, 1.0]


def test_a_run_whose_values_are_not_admissible_is_refused_and_leaves_the_others_alone(tmp_path):
    simulation = case(keep=ENDS, over={"initial.phi": [0.2, 1.2, 0.4], "initial.T": [-1.0, 300.0]})
    data = stored(tmp_path / "o.zarr", simulation).dataset
    assert [[STATUSES[code] for code in row] for row in data["status"].values] == [
        ["refused", "finished"],
        ["refused", "refused"],
        ["refused", "finished"],
    ]
    assert np.isnan(data["T_last"].values[:, 0]).all()
    alone = simulation.run({"initial.phi": 0.4}).dataset["T"].values[-1]
    assert data["T_last"].values[2, 1] == pytest.approx(alone, rel=1e-10)


def test_what_diverges_is_told(tmp_path):
    """Friction that grows with the fourth power of the temperature."""
    hotter = [{"coulomb": {"mu": {"value": 0.3, "times": [{"power": {"exponent": 4}}]}}}]
    over = {"over": {"loading.p": ["100 kPa", "200 kPa"]}, "keep": {"last": ["T"]}}
    simulation = surfacechem.load("sliding-dry", {"interface.friction": hotter, "sweep": over})
    data = stored(tmp_path / "o.zarr", simulation).dataset
    assert {data.attrs["reasons"][code] for code in data["reason"].values} == {"T runs away"}


def test_threads_pieces_and_parts_change_no_byte(whole, tmp_path, monkeypatch):
    stored(tmp_path / "threads.zarr", threads=3)
    assert digest(tmp_path / "threads.zarr") == digest(whole)
    for k in (2, 1, 3):
        stored(tmp_path / "parts.zarr", part=(k, 3))
    assert digest(tmp_path / "parts.zarr") == digest(whole)
    monkeypatch.setattr(streaming, "RUNS_OF_A_PIECE", 64)
    monkeypatch.setattr(streaming.ChunkRuns, "piece", 5)
    stored(tmp_path / "pieces.zarr")
    assert digest(tmp_path / "pieces.zarr") == digest(whole)


GIVEN = ["sweep", "exothermic", "--over", f"{K_0}={{from: 100, to: 300, points: 60}}", "--set"]
GIVEN += ["sweep.keep={last: [T, phi]}", "-o"]
SLOW_COMMAND = """
import sys, time
from surfacechem.cli import app
from surfacechem.results.store import Store
from surfacechem.runs import checking, keeping, streaming
streaming.EXPLICIT_RUNS = 16
write = Store.write
def slowly(self, number, *chunk):
    write(self, number, *chunk)
    time.sleep(60 if number else 0)
Store.write = slowly
app(sys.argv[1:])
"""
"""The command, with a long pause after its second chunk, in which it is ended."""
INTERRUPTED = "surfacechem: interrupted; what is stored is kept: go on with --resume.\n"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_an_ended_writer_loses_at_most_a_chunk_and_no_byte(whole, tmp_path, number):
    told, code = ("", -number) if number == signal.SIGKILL else (INTERRUPTED, 128 + number)
    path = tmp_path / "o.zarr"
    resume = [*GIVEN, str(path), "--resume", "-q"]
    # Processes in the background of a shell are started with interrupts ignored.
    own = signal.signal(signal.SIGINT, signal.SIG_DFL)
    writer = subprocess.Popen([sys.executable, "-c", SLOW_COMMAND, *resume[:-2]], stderr=subprocess.PIPE, text=True)
    signal.signal(signal.SIGINT, own)
    while not (path / ".marks" / "1").exists():
        assert writer.poll() is None, writer.communicate()
        time.sleep(0.01)
    assert "another process is writing part 1-of-1" in CliRunner().invoke(app, resume).output
    writer.send_signal(number)
    assert (writer.communicate()[1], writer.returncode) == (told, code)
    assert {file.name for file in (path / ".marks").iterdir()} - {"writer-1-of-1"} == {"0", "1"}
    kept = {file: file.stat().st_mtime_ns for file in path.glob("*_last/c/[01]")}
    assert CliRunner().invoke(app, resume).exit_code == 0
    assert kept == {file: file.stat().st_mtime_ns for file in kept}
    found, wanted = digest(path), digest(whole)
    chunks = {file for file in wanted if "c" in file.parts}
    assert {file: found[file] for file in chunks} == {file: wanted[file] for file in chunks}


def test_a_damaged_chunk_is_computed_again(whole, tmp_path):
    path = tmp_path / "o.zarr"
    stored(path)
    (path / "T_last/c/2").write_bytes(b"damaged")
    (path / ".marks/0").write_bytes(b"\xff")
    (path / "phi_last/c/1").unlink()
    told = []
    stored(path, resume=True, on_progress=told.append)
    assert told[0].resumed == 60 - 3 * 16
    assert digest(path) == digest(whole)


def test_what_a_store_has_from_its_beginning_is_restored(whole, tmp_path):
    """Coordinates, and descriptions of arrays; until then what is lost is not a number, and what is damaged is told."""
    path = tmp_path / "o.zarr"
    stored(path)
    (path / "K_0/c/0").unlink()
    (path / "status/zarr.json").write_text("{")
    assert np.all(np.isnan(opened(path).K_0))
    stored(path, resume=True)
    assert digest(path) == digest(whole)
    (path / "K_0/c/0").write_bytes(b"damaged")
    with pytest.raises(InputError, match="is no readable store: "):
        opened(path)


def test_coordinates_are_written_in_parts(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "COORDINATE_PART", 7)
    with stored(tmp_path / "o.zarr").dataset as data:
        np.testing.assert_array_equal(data["K_0"], np.linspace(100, 300, 60))


def test_another_sweep_or_what_is_no_store_is_refused(whole, tmp_path):
    with pytest.raises(InputError, match="is there already: --resume goes on with it"):
        stored(whole)
    with pytest.raises(InputError, match=r"belongs to another sweep\. Different: the case, what is kept\."):
        stored(whole, case(keep={"last": ["T"]}), resume=True)
    with pytest.raises(InputError, match=r"belongs to another sweep\. Different: the case, the plan\."):
        stored(whole, case(keep=ENDS, over={K_0: [1.0, 2.0]}), resume=True)
    with pytest.raises(InputError, match=r"belongs to another sweep\. Different: the changes\."):
        stored(whole, changes={"initial.T": 310.0}, resume=True)
    (tmp_path / "foreign.zarr").mkdir()
    (tmp_path / "foreign.zarr" / "zarr.json").write_text("{}")
    with pytest.raises(InputError, match="is no store of a sweep"):
        stored(tmp_path / "foreign.zarr", resume=True)
    for part in ((0, 4), (5, 4), (1, 0), (1.5, 3), 3):
        with pytest.raises(InputError, match=r"is no part; the first of 16 is \(1, 16\)"):
            stored(tmp_path / "o.zarr", part=part)
    with pytest.raises(InputError, match="there is no folder"):
        stored(tmp_path / "no" / "o.zarr")
    with pytest.raises(InputError, match="no quantities are called 'Tee'"):
        stored(tmp_path / "o.zarr", case(keep={"last": ["Tee"]}))
    assert not (tmp_path / "o.zarr").exists()


def test_a_store_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # of a superuser nothing is protected
    with pytest.raises(InputError, match="cannot be written: it is read-only"):
        stored(tmp_path / "o.zarr")


def test_a_full_disk_is_an_error_of_a_line_and_loses_nothing(whole, tmp_path, monkeypatch):
    path, soft = tmp_path / "o.zarr", resource.getrlimit(resource.RLIMIT_FSIZE)
    stream = (simulation := case(keep=ENDS)).stream(simulation.plan(), path)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, soft[1]))
        with pytest.raises(OutputError, match=r"cannot be written: .*go on with --resume"):
            stream.run(1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, soft)
    stored(path, resume=True)
    assert digest(path) == digest(whole)


@pytest.mark.parametrize("killed", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_cluster_changes_no_byte_even_where_a_worker_is_killed(whole, tmp_path, killed):
    """Workers that share this process are there at once, but cannot be killed."""
    distributed = pytest.importorskip("distributed")
    workers = {"n_workers": 2, "threads_per_worker": 1, "processes": killed}
    with distributed.LocalCluster(**workers, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
        victim = next(iter(client.run(os.getpid).values()))
        told = []

        def kill(progress):
            if killed and progress.done == 16:
                os.kill(victim, signal.SIGKILL)
            told.append(progress)

        stored(tmp_path / "o.zarr", client=client, on_progress=kill)
    assert told[-1].done == 60
    assert digest(tmp_path / "o.zarr") == digest(whole)


@pytest.mark.parametrize(
    ("name", "path", "size"),
    [
        ("exothermic", "initial.T", "EXPLICIT_RUNS"),
        ("dna-adhesive", "initial.T_2", "IMPLICIT_RUNS"),
        ("stick-slip", "initial.T", "JUMPING_RUNS"),
        ("sticky-sphere", "mechanics.normal.k", "SLOW_RUNS"),
    ],
)
def test_chunks_are_as_long_as_their_runs_are_brief(name, path, size, monkeypatch):
    monkeypatch.setattr(streaming, size, 7)
    simulation = surfacechem.load(name)
    chunks = streaming.ChunkRuns(simulation, simulation.plan({path: [300.0]}), Keep(), {})
    assert chunks.at_once == 7


@pytest.mark.parametrize(
    ("name", "solver", "told"),
    [
        ("exothermic", None, "eight runs at once, by explicit steps of order 8"),
        ("dna-adhesive", None, "eight runs at once, by Radau IIA of order 9"),
        ("dna-adhesive", "radau", "one run after another in the compiled loop, by radau"),
        ("sticky-sphere", None, "one run after another, each prepared in Python, by radau"),
        ("force-spectroscopy", None, "eight runs at once, by explicit steps of order 8"),
    ],
)
def test_the_steps_of_runs_follow_from_stiffness(name, solver, told):
    path = {"dna-adhesive": "initial.T_2", "sticky-sphere": "mechanics.normal.k", "force-spectroscopy": X_OFF}.get(
        name, "initial.T"
    )
    section = {"over": {path: [300.0]}, "keep": {"last": "all"}}
    simulation = surfacechem.load(name, {"sweep": section, **({"run.solver": solver} if solver else {})})
    assert streaming.steps_of(simulation) == told


def test_runs_whose_loads_pass_narrow_features_are_solved_by_themselves():
    """The rate of the second run is cut off where its exponent overflows: a time at which a step has to end."""
    simulation = surfacechem.load("force-spectroscopy")
    chunks = streaming.ChunkRuns(simulation, simulation.plan({X_OFF: [4e-10, 1e-7, 6e-10]}), Keep(), {})
    done, found = chunks.arrays.solve(chunks.plan.at(np.arange(3)))
    assert done.tolist() == [True, False, True]
    assert len(found["steps"]) == 2


def test_temperatures_without_capacity_are_found_at_the_starts_of_all_runs_at_once():
    simulation = surfacechem.load("three-temperatures-no-capacity")
    keep = Keep(last=("T_c", "T_1"), max=("T_c",), min=("T_2",))
    plan = simulation.plan({"bodies.lower.C": [100.0, 200.0, 300.0]})
    chunks = streaming.ChunkRuns(simulation, plan, keep, {})
    done, found = chunks.arrays.solve(plan.at(np.arange(3)))
    assert done.all()
    alone = chunks.one_by_one.columns(chunks._solved(plan.at(np.arange(3)), np.arange(3)), len(chunks.run.times))
    assert len(set(alone["T_c_last"])) == 3
    for name in ("steps", "T_c_last", "T_1_last", "T_c_max", "T_2_min"):
        np.testing.assert_array_equal(found[name], alone[name], err_msg=name)


def test_runs_that_arrays_leave_open_at_their_start_need_no_tables(monkeypatch):
    """A slider that nothing resists: in arrays no run of the pilots takes a step, nor has an output in their memory."""
    scene, end = random_scene(128)
    simulation = surfacechem.Simulation.of(scene, Run(times=(0.0, end)))
    plan = simulation.plan({"interface.friction.coulomb.mu": np.linspace(0.4, 0.6, 40)})
    chunks = streaming.ChunkRuns(simulation, plan, Keep(last=("v",), max=("v",)), {})
    used = lambda shape, dtype=float, **_: np.full(shape, np.inf if np.dtype(dtype).kind == "f" else 0, dtype)  # noqa: E731
    monkeypatch.setattr(np, "empty", used)
    found = chunks.columns(np.arange(plan.size))
    assert set(found["status"]) == {STATUSES.index("stopped")}


@pytest.mark.skipif(sys.platform != "linux", reason="counts pages as Linux does")
def test_the_memory_of_arrays_is_kept_for_the_next_runs():
    """Pages that the system clears anew for each part of a sweep take longer than the arithmetic."""
    simulation = surfacechem.load("exothermic")
    plan = simulation.plan({K_0: {"from": 100, "to": 300, "points": 200}})
    runs = streaming.ChunkRuns(simulation, plan, Keep(last=("T",), max=("q_1", "T"), min=("q_1",)), {})
    faults = []
    for _ in range(3):
        runs.columns(np.arange(plan.size))
        faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
    assert faults[2] - faults[1] < plan.size / 2


def test_runs_with_more_steps_than_usual_are_computed_in_smaller_parts(monkeypatch):
    """Tables for all steps of all runs would not stay small."""
    simulation = surfacechem.load("exothermic")
    plan = simulation.plan({K_0: {"from": 100, "to": 300, "points": 20}})
    runs = streaming.ChunkRuns(simulation, plan, Keep(last=("T",), max=("q_1",)), {}).arrays
    done, whole = runs.solve(plan.at(np.arange(20)))
    usual = runs.at_once
    runs.most_steps = 10_000
    assert runs.at_once < usual / 5
    monkeypatch.setattr(arrays, "CHUNK_BYTES", arrays.CHUNK_BYTES * 3 // runs.at_once)
    assert 1 < runs.at_once < 10
    again, parts = runs.solve(plan.at(np.arange(20)))
    assert done.all()
    assert again.all()
    for name, values in whole.items():
        np.testing.assert_array_equal(parts[name], values, err_msg=name)


def test_chunks_of_a_grid_are_blocks_of_it():
    layout = Layout(
        {"a": 5, "b": 7, "time": 3}, ("a", "b"), {"x": StoredArray("float64", ("a", "b"), {})}, {}, [], {}, 16
    )
    assert (layout.chunk, layout.counts, layout.chunks) == ((2, 7), (3, 1), 3)
    assert np.array_equal(np.concatenate([layout.index(k) for k in range(3)]), np.arange(35))
    huge = Layout(
        {"a": 2**20, "b": 2**20}, ("a", "b"), {"x": StoredArray("float64", ("a", "b"), {})}, {}, [], {}, 2**14
    )
    assert huge.region(huge.chunks - 1) == (slice(2**20 - 1, 2**20), slice(2**20 - 2**14, 2**20))


def test_commands_write_a_store_and_go_on_with_it(tmp_path):
    path = tmp_path / "o.zarr"
    given = ["sweep", "exothermic", "--over", f"{K_0}=[100, 200, 300]", "-o", str(path)]
    for part, told in (("2/2", "0 of 3 runs\n"), ("1/2", "3 of 3 runs: 3 finished")):  # there is one chunk
        result = CliRunner().invoke(app, [*given, "--part", part])
        assert result.exit_code == 0, result.output
        assert told in result.output
    assert CliRunner().invoke(app, given).exit_code == 2
    assert CliRunner().invoke(app, [*given, "--resume", "-q"]).exit_code == 0
    for option, message in ((["--part", "5/4"], "'5/4' is no part"), (["--cluster", "nowhere"], "--cluster")):
        assert message in CliRunner().invoke(app, [*given, *option]).output
    data = opened(path)
    assert data["K_0"].values.tolist() == [100, 200, 300]
    assert data["T_max"].attrs["units"] == "K"


def test_what_is_kept_goes_into_one_file_as_into_a_store(tmp_path):
    few = [part.replace("points: 60", "points: 8") for part in GIVEN]
    for suffix in ("zarr", "nc", "csv"):
        result = CliRunner().invoke(app, [*few, str(tmp_path / f"o.{suffix}")])
        assert result.exception is None, result.exception
        assert (result.exit_code, "e-11 of 8 runs" in result.output) == (0, True), result.output
    assert {path.name for path in tmp_path.iterdir()} == {"o.zarr", "o.nc", "o.csv"}
    with opened(tmp_path / "o.zarr") as stored, xarray.open_dataset(tmp_path / "o.nc") as file:
        xarray.testing.assert_equal(stored.load(), file.load())
        with (tmp_path / "o.csv").open() as table:
            assert [float(row["T_last [K]"]) for row in csv.DictReader(table)] == file["T_last"].values.tolist()
    for told, given in {
        "is a folder. A store is not run again": ["rerun", "o.zarr"],
        "o.zarr: is a sweep that keeps a part of its runs": ["report", "o.zarr"],
        "o.nc: is a sweep that keeps a part of its runs, of which there is no report; plot it": ["report", "o.nc"],
    }.items():
        assert told in CliRunner().invoke(app, [given[0], str(tmp_path / given[1])]).output
    again = CliRunner().invoke(app, ["rerun", str(tmp_path / "o.nc"), "-o", str(tmp_path / "again.nc")])
    assert "variables are bit for bit the same" in again.output
    assert CliRunner().invoke(app, ["rerun", str(tmp_path / "again.nc")]).exit_code == 0


def test_a_table_of_series_has_a_row_for_each_output_and_words_for_codes(tmp_path):
    kept = ["--set", "run.outputs=4", "--set", "sweep.keep={last: [phi], series: [T]}"]
    given = ["sweep", "exothermic", "--over", f"{K_0}=[100, 200]", "--over", "initial.phi=[0, 1.2]", *kept, "-q"]
    for suffix in ("nc", "csv"):
        assert CliRunner().invoke(app, [*given, "-o", str(tmp_path / f"o.{suffix}")]).exit_code == 0
    with (tmp_path / "o.csv").open() as table, xarray.open_dataset(tmp_path / "o.nc") as file:
        rows = list(csv.DictReader(table))
        shown = np.array([float(row["T [K]"] or "nan") for row in rows])
        np.testing.assert_array_equal(shown, file["T"].values.ravel())
    ends = {(row["status"], row["reason"]) for row in rows}
    assert ends == {("finished", "reached the end"), ("refused", "the values are not admissible at the start")}


def test_errors_of_runs_that_are_checked_are_those_of_a_sweep(tmp_path, monkeypatch):
    over = {"initial.phi": [0.0, 1.2], K_0: {"from": 50, "to": 300, "points": 7}}
    stream = begun(case(keep=ENDS, over=over, checked="all"), tmp_path / "o.zarr")
    assert check(stream) is None
    data = stream.run(1).dataset
    found = check(stream)
    again = case(over={**over, "initial.phi": [0.0]})
    swept = again.sweep_plan(again.plan(), run=replace(again.case.run, picture=None))
    assert np.array_equal(data["checked_run"], np.arange(14))
    for name in ("error", "energy_error", "entropy_error", "site_error", "destroys_entropy"):
        assert np.array_equal(data[f"checked_{name}"][:7], swept.dataset[name].values.ravel())
    assert np.isnan(data["checked_error"][7:]).all()
    assert (found.error, found.unknown, found.count) == (swept.dataset.attrs["error"], 7, 14)
    assert found.source == swept.dataset.attrs["error_source"]
    steps, hardest = data["steps"].values.ravel(), data["hardest_run"].values
    assert sorted(hardest[hardest >= 0]) == list(range(7))
    monkeypatch.setattr(checking, "HARDEST_RUNS", 3)
    few = checking._hardest(stream)
    assert sorted(steps[few]) == sorted(np.sort(steps)[-3:])


def test_what_is_left_below_the_tolerance_is_no_error(tmp_path):
    """Bonds that have all but vanished in every run that is checked."""
    stream = begun(case("force-spectroscopy", {"last": "all"}, {X_OFF: [4.98e-10, 5e-10]}), tmp_path / "o.zarr")
    stream.run(1)
    assert np.all(abs(stream.store.dataset["phi_last"]) < 1e-15)
    assert check(stream).error < 1e-9


def test_a_notebook_shows_where_a_store_is_and_not_all_that_it_is_made_of(tmp_path):
    stream = begun(case(keep=ENDS, over={"initial.T": [290, 310]}), tmp_path / "o.zarr")
    assert repr(stream) == f"Stream(store={stream.store}, part=(1, 1))"
    assert repr(stream.store) == f"Store(path={tmp_path / 'o.zarr'!r})"


def test_runs_that_failed_are_run_again_alone(tmp_path):
    path = tmp_path / "o.zarr"
    given = ["sweep", "exothermic", "--over", f"{K_0}={{from: 0.01, to: 300, points: 8}}", "-q"]
    sparse = ["--set", "run.max-steps=10", "--set", "sweep.keep={last: [T]}", "-o", str(path)]
    assert CliRunner().invoke(app, [*given, *sparse]).exit_code == 4
    failed = opened(path).where(opened(path)["status"] == STATUSES.index("failed"), drop=True)
    assert 0 < failed.sizes["K_0"] < 8
    again = ["--set", "sweep.keep={last: [T]}", "-o", str(path), "--only", "failed"]
    assert CliRunner().invoke(app, [*given, *again]).exit_code == 0
    # Once more with another setting, and going on with that; the plan is that of the store.
    once_more = ["sweep", "exothermic", *again, "--set", "run.max-steps=500"]
    assert [CliRunner().invoke(app, [*once_more, *more]).exit_code for more in ([], ["--resume"])] == [0, 0]
    assert np.array_equal(opened(tmp_path / "o-failed-2.zarr")["K_0"], failed["K_0"])
    assert len(list(tmp_path.iterdir())) == 3
    data = opened(tmp_path / "o-failed.zarr")
    assert np.array_equal(data["K_0"], failed["K_0"])
    alone = surfacechem.load("exothermic").run({K_0: data["K_0"].values[0]}).dataset
    assert data["T_last"].values[0] == pytest.approx(alone["T"].values[-1], rel=1e-10)
    assert "no run of it is stopped" in CliRunner().invoke(app, [*given, *again[:-1], "stopped"]).output
    assert "no runs are called 'faild'" in CliRunner().invoke(app, [*given, *again[:-1], "faild"]).output

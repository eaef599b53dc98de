"""Events of moving gaps: at the start, at breakpoints, coincident, brief, without end; energies and verdicts."""

import numpy as np
import pytest
import tables_mechanics as scenes
from scenes import SITES, path, perfect_contact, varying
from tables_mechanics import solve

from surfacechem.laws.bonding import BondEnergy
from surfacechem.laws.bulk import Constant, Quadratic
from surfacechem.laws.cohesive import TensileStrength
from surfacechem.laws.contact import BondedContact, InterfaceCapacity, Penalty, TangentialStiffness
from surfacechem.laws.factors import Linear, LinearInTemperature
from surfacechem.laws.friction import Coulomb
from surfacechem.laws.loading import Harmonic, Hold, Ramp, Table
from surfacechem.model.assemble import assemble
from surfacechem.results.audit import audit
from surfacechem.scene import Body, Interface, Mounting, Scene, Stage
from surfacechem.solve.jumps import ADMISSIBLE
from surfacechem.solve.run import Model, Run

COLD = Body("lower", Hold(level=300.0)), Body("upper", Hold(level=300.0))


def slider(friction, mounting, drive, p=1e5, potentials=(), programme=(), **initial) -> Model:
    """Reservoirs about a contact that sticks and slides."""
    loading = {} if drive is None else {"w_t": drive}
    loading |= {"p": p if not isinstance(p, float) else Hold(level=p)}
    scene = Scene(
        COLD,
        Interface(Hold(level=300.0), potentials, [friction]),
        loading=loading,
        T_0=300.0,
        initial=initial,
        tangential=mounting,
        programme=programme,
    )
    return Model(assemble(scene))


def names(solved) -> list[str]:
    return [jump.edge.name for jump in solved.jumps]


class TestTime:
    def test_limit_exceeded_from_the_start(self):
        """A spring stretched beyond the limit starts to slide at once, in its own direction."""
        for u, word in ((-1e-3, "forward"), (1e-3, "backward")):
            solved = solve(
                slider(Coulomb(mu=0.4, mu_s=0.6), Mounting(k=1e8, m=10.0), Hold(level=0.0), u_t=u), (0.0, 1e-2)
            )
            assert solved.jumps[0].t == 0.0
            assert names(solved)[:2] == [f"slip {word}", "stop"]
            assert solved["v"][-1] == 0.0

    def test_sliding_from_the_start(self):
        """The mode follows from the initial velocity; the stop is where Newton's law has it."""
        solved = solve(slider(Coulomb(mu=0.4), Mounting(m=10.0), None, v=-2.0, u_t=0.0), (0.0, 1.0))
        assert names(solved) == ["stop"]
        assert solved.jumps[0].t == pytest.approx(10.0 * 2.0 / 4e4, rel=1e-13)
        assert solved["u_t"][-1] == pytest.approx(-10.0 * 4.0 / 8e4, rel=1e-12)
        assert solved["v"][-1] == 0.0

    def test_event_at_a_breakpoint_and_in_the_last_instant(self):
        """The limit is reached exactly where the history turns, and where the run ends."""
        rises = Table(times=[0.0, 1.0, 2.0], values=[0.0, 6e-4, 6e-4])
        solved = solve(slider(Coulomb(mu=0.6), Mounting(k=1e8), rises), (0.0, 2.0))
        assert solved.status == "finished"
        assert solved["u_t"][-1] == pytest.approx(0.0, abs=1e-12)
        ramp = Ramp(rate=6e-4)
        last = solve(slider(Coulomb(mu=0.6), Mounting(k=1e8), ramp), (0.0, 1.0))
        assert last.status == "finished"
        assert last["u_t"][-1] == pytest.approx(0.0, abs=1e-12)

    def test_margin_that_touches_zero_and_turns_back(self):
        """Exactly at the limit nothing slides; a little beyond it does."""
        for excess, slides in ((-1e-6, False), (1e-6, True)):
            drive = Harmonic(amplitude=6e-4 * (1 + excess), frequency=1.0)
            solved = solve(slider(Coulomb(mu=0.4, mu_s=0.6), Mounting(k=1e8, m=1e-3), drive), (0.0, 0.5))
            assert bool(solved.jumps) == slides

    @pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-9])
    def test_brief_pulse_is_never_missed(self, width):
        pulse = Table(times=[0.0, 0.3, 0.3 + width, 0.3 + 2 * width], values=[0.0, 0.0, 1e-3, 0.0])
        solved = solve(slider(Coulomb(mu=0.6), Mounting(k=1e8), pulse), (0.0, 1.0))
        assert names(solved)[0] == "slip forward"
        assert solved.jumps[0].t == pytest.approx(0.3 + 0.6 * width, abs=2e-16 + 1e-9 * width)

    def test_two_transitions_at_the_same_time(self):
        """A stage that ends just as sticking gives way: both happen, once."""
        stages = (Stage("pull", {"w_t": 1e-3}, duration=0.6), Stage("rest", {}))
        model = slider(Coulomb(mu=0.6), Mounting(k=1e8), None, programme=stages, w_t=0.0)
        solved = solve(model, (0.0, 1.0))
        assert names(solved).count("end of pull") == 1
        assert solved.status == "finished"
        assert solved["u_t"][-1] == pytest.approx(0.0, abs=1e-12)

    def test_outputs_never_change_the_events(self):
        runs = [scenes.slider().solve(Run(times=(0.0, *times))) for times in ([9.0], np.linspace(0.01, 9.0, 1234))]
        first, second = ([(j.t, j.edge.name, *j.after.y) for j in run.jumps] for run in runs)
        assert len(first) > 30
        assert first == second

    def test_a_thousand_events(self):
        solved = solve(scenes.slider(), (0.0, 202.0), {"loading.w_t.rate": 1e-3})
        assert len(solved.jumps) > 1000
        assert solved.energy_error < 1e-9
        assert names(solved)[:1000] == ["slip forward", "stop"] * 500


class TestChatter:
    def test_equal_limits_slide_steadily(self):
        """Static and kinetic friction alike: one start, then sliding at the speed of the drive, without flips."""
        solved = solve(slider(Coulomb(mu=0.4), Mounting(k=1e8, c_b=1e4), Ramp(rate=1e-3)), (0.0, 1.0, 2.0))
        assert names(solved) == ["slip forward"]
        assert solved["u_t"][-1] - solved["u_t"][-2] == pytest.approx(1e-3, rel=1e-9)

    @pytest.mark.parametrize("mu_s", [None, 0.1])
    def test_limit_not_above_kinetic_friction(self, mu_s):
        """A static limit below the sliding one is the sliding one; a damped mass ends up in steady motion."""
        friction = Coulomb(mu=0.4, mu_s=mu_s)
        solved = solve(slider(friction, Mounting(k=1e8, m=10.0, c_b=3e4), Ramp(rate=1e-3)), (0.0, 1.0, 2.0))
        assert solved.status == "finished"
        assert len(solved.jumps) < 10
        assert solved["u_t"][-1] - solved["u_t"][-2] == pytest.approx(1e-3, rel=1e-6)

    @pytest.mark.parametrize("mounting", [Mounting(k=1e8), Mounting(k=1e8, c_b=1e5), Mounting(k=1e8, m=0.1, c_b=1e3)])
    @pytest.mark.parametrize("elastic", [False, True])
    def test_drive_that_swings_about_the_limit(self, mounting, elastic):
        drive = Table(times=np.arange(41.0).tolist(), values=[(6e-4 + 1e-5 * (-1) ** n) * (n > 0) for n in range(41)])
        potentials = [TangentialStiffness(E_t=1e10)] if elastic else []
        solved = solve(slider(Coulomb(mu=0.6), mounting, drive, potentials=potentials), (0.0, 40.0))
        assert solved.status == "finished", solved.reason
        assert len(solved.jumps) < 200
        assert solved.energy_error < 1e-7

    def test_friction_that_fades_with_temperature(self):
        """The limit itself falls below the traction as the bodies warm up."""
        mu = varying(0.6, LinearInTemperature(slope=-1e-2))
        scene = perfect_contact(
            [],
            frictions=[Coulomb(mu=mu)],
            energy=Constant,
            loading={"p": Hold(level=1e5), "w_t": Hold(level=3e-4), "Q_1": Hold(level=100.0)},
            tangential=Mounting(k=1e8, c_b=1e4),
        )
        solved = solve(Model(assemble(scene)), np.linspace(0.0, 1.9, 20))
        assert names(solved)[0] == "slip forward"
        # mu p = 3e4 Pa where T - T_0 = 50 K; two bodies of 1 J/(m^2 K) are warmed by 100 W/m^2.
        assert solved.jumps[0].t == pytest.approx(1.0, rel=1e-9)
        assert solved.energy_error < 1e-9

    def test_friction_of_a_contact_that_opens(self):
        """Friction ends where the pressure does, and comes back with it."""
        scene = Scene(
            COLD,
            Interface(None, [Penalty(E_n=1e13)], [Coulomb(mu=0.4)]),
            loading={
                "w_n": Table(times=[0.0, 1.0, 2.0, 3.0], values=[-1e-8, 1e-8, 1e-8, -1e-8]),
                "w_t": Ramp(rate=1e-6),
            },
            initial={"g_n": -1e-9, "u_t": 0.0, "v": 0.0},
            normal=Mounting(k=1e13, c_g=1e6),
            tangential=Mounting(k=1e10, m=1e-3, c_b=1e4),
        )
        solved = solve(Model(assemble(scene)), np.linspace(0.0, 3.0, 31))
        assert solved.status == "finished", solved.reason
        open_ = solved["g_n"] > 0
        assert np.any(open_)
        assert np.all(solved["t_coulomb"][open_] == 0.0)
        assert solved.energy_error < 1e-8


class TestJumps:
    @pytest.mark.parametrize("release", ["joint", "local"])
    @pytest.mark.parametrize("medium", [False, True])
    def test_debonding_conserves_energy(self, release, medium):
        """Into the bodies or into the interface; with the spring, or at a gap that stays what it is."""
        potentials = [BondedContact(E_n=1e12), BondEnergy(K_0=1e-3)]
        potentials += [InterfaceCapacity(C_c=1e-3)] if medium else []
        heat = [path("interface", "lower", 1e-3), path("interface", "upper", 1e-3)] if medium else []
        pair = (
            (Body("lower", "T_1", Quadratic(C=1.0)), Body("upper", "T_2", Quadratic(C=2.0)))
            if medium
            else (Body("lower", "T", Quadratic(C=1.0)), Body("upper", "T", Quadratic(C=2.0)))
        )
        initial = {"T_1": 300.0, "T_2": 300.0, "T_c": 300.0} if medium else {"T": 300.0}
        limits = [TensileStrength(t_max=1e6, release=release)]
        scene = Scene(
            pair,
            Interface("T_c" if medium else "T", potentials, sites=SITES, limits=limits),
            heat,
            loading={"w_n": Ramp(rate=1e-6)},
            T_0=300.0,
            initial=initial | {"phi": 1.0},
            normal=Mounting(k=1e12, beta_1=0.25),
        )
        solved = solve(Model(assemble(scene)), np.linspace(0.0, 4.0, 5))
        assert solved.status == "finished", solved.reason
        (jump,) = solved.of("debond")
        assert jump.verdict == ADMISSIBLE
        assert jump.t == pytest.approx(2.0, rel=1e-9)
        # t_n^2 / 2 (1/k + 1/E_n), less the energy of the bonds; the springs release theirs after what is local.
        followed = sum(jump.released for jump in solved.of("relax"))
        assert followed == pytest.approx({"joint": 0.0, "local": 0.5}[release], rel=1e-9)
        assert jump.released + followed == pytest.approx(1e12 / 2 * 2e-12 - 0.5e-3, rel=1e-9)
        assert solved.energy_error < 1e-9
        if medium and release == "joint":
            warmed = [solved.state(jump, name) ** 2 - 300.0**2 for name in ("T_1", "T_2")]
            # The first body takes a quarter of the heat and has half the capacity of the second.
            assert warmed[0] / warmed[1] == pytest.approx(0.25 / 0.75 * 2.0, rel=1e-6)

    def test_reservoirs_pass_the_heat_on(self):
        solved, _ = scenes.pull_off(scenes.rows("h_pulloff_vs_stiffness")[5])
        for jump in solved.jumps:
            assert jump.heat_out == pytest.approx(jump.released, rel=1e-14)
            assert jump.entropy_out == pytest.approx(jump.released / 300.0, rel=1e-14)
        assert solved["H_events"][-1] == pytest.approx(-sum(jump.released for jump in solved.jumps), rel=1e-12)
        assert solved.energy_error < 1e-12

    def test_bonds_break_as_sliding_starts(self):
        """The energy of the bonds is taken from heat, which the verdict says."""
        solved = solve(scenes.rebonding_slider(), (0.0, 30.0))
        assert all(jump.verdict == ADMISSIBLE for jump in solved.jumps)
        assert all(solved.state(jump, "phi") == 0.0 for jump in solved.of("slip"))

    @pytest.mark.parametrize(
        "mounting",
        [
            Mounting(k=1e13, m=0.01),
            Mounting(k=1e13, m=0.01, c_b=1e5, c_g=1e4),
            Mounting(k=1e13, c_g=1e5),
            Mounting(k=1e13),
        ],
    )
    def test_contact_that_closes_and_opens(self, mounting):
        """In every mounting: pressed shut, pulled open, loads removed at the end."""
        history = Table(times=[0.0, 1.0, 2.0, 3.0], values=[1e-8, -1e-8, 1e-8, 0.0])
        scene = perfect_contact([Penalty(E_n=1e14)], C_1=1e-3, C_2=1e-3, loading={"w_n": history}, normal=mounting)
        scale = 1e-6
        if mounting.m:
            # A rigid collision of a microsecond, not a second of oscillations.
            history = Table(times=[scale * t for t in history.times], values=history.values)
            scene = Scene(**scene.__dict__ | {"loading": {"w_n": history}})
        end = history.times[-1]
        scene = Scene(**scene.__dict__ | {"initial": {"T": 300.0, "g_n": 1e-8}})
        solved = solve(Model(assemble(scene)), np.linspace(0.0, end, 31))
        assert solved.status == "finished", solved.reason
        assert min(solved["g_n"]) < 0 < max(solved["g_n"])
        assert solved.findings == ()
        if mounting.m == 0:
            assert solved["g_n"][10] == pytest.approx(-1e-8 / 11, rel=1e-2)


@pytest.mark.parametrize("p", [6559.108123501283, 6015.564932235646, 8743.24723568622, 4958.0812951006765])
def test_sliding_that_only_dampers_resist_begins_from_rest(p):
    """Its velocity is nothing but rounding of tractions at first; then u relaxes to the drive."""
    k, c, rate, mu = 1e13, 1e9, 1e-6, 0.3
    drive, onset = Ramp(rate=rate), (mu * p - c * rate) / (k * rate)
    solved = solve(slider(Coulomb(mu=mu), Mounting(k=k, c_b=c), drive, p=p), np.linspace(0.0, 4.0, 41))
    assert solved.status == "finished", solved.reason
    assert names(solved) == ["slip forward"]
    assert solved.jumps[0].t == pytest.approx(onset, rel=1e-9)
    after = np.linspace(0.0, 4.0, 41)[1:] - onset
    slid = rate * (after - c / k * -np.expm1(-k / c * after))
    np.testing.assert_allclose(solved["u_t"][1:], slid, rtol=1e-8)


def test_work_on_a_contact_at_rest():
    """A smooth drive that never slides takes back what it gives."""
    drive = Harmonic(amplitude=1e-4, frequency=1.3)
    solved = solve(slider(Coulomb(mu=0.6), Mounting(k=1e8), drive), np.linspace(0.0, 10.0, 3))
    assert audit(solved.trajectory).energy_error < 1e-9


def test_bonds_form_only_while_sticking():
    factor = Linear(of="sticking", about=1.0, slope=1.0)
    assert (factor.factor(x=1.0), factor.factor(x=0.0)) == (1.0, 0.0)

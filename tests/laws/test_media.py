"""Media: fits against CoolProp, runs that leave their range, what is refused, and nothing imported without need."""

import dataclasses

import numpy as np
import pytest
from sampling import every

import surfacechem
from surfacechem import format as case
from surfacechem.contracts import fits
from surfacechem.errors import InputError
from surfacechem.laws.coolprop import PROPERTIES, CoolPropFluid
from surfacechem.laws.films import Film, FilmCapacity, FilmShear, FilmWear, RarefiedFilm, Roelands, Vogel
from surfacechem.laws.free_energy import Constant, ConstantInterfaceCapacity
from surfacechem.laws.friction import Viscous
from surfacechem.laws.loading import Hold
from surfacechem.model.assemble import assemble
from surfacechem.results.error_estimates import computed
from surfacechem.runs import simulation
from surfacechem.scene import Body, Interface, Medium, Scene
from surfacechem.solve.run import Model, Run

pytestmark = pytest.mark.around

BOUND = 1e-8
FLUIDS = [("Air", 1e5, 250.0, 400.0), ("Water", 1e6, 280.0, 360.0), ("INCOMP::MEG-50%", 1e5, 260.0, 300.0)]


def medium(fluid="Water", p=1e5, thickness=2e-6, reached=()) -> Medium:
    return Medium(CoolPropFluid(fluid, p), {}, thickness, temperatures=reached)


def lubricated(found: Medium, v=2.0, T=300.0, C=500.0, capacity=True) -> Scene:
    """Two bodies that slide on a film of the medium."""
    interface = Interface("T_c", [FilmCapacity()] * capacity, [FilmShear()], medium=found)
    pair = Body("lower", "T_1", Constant(C=C)), Body("upper", "T_2", Constant(C=C))
    initial = {"T_1": T, "T_2": T} | ({"T_c": T} if capacity else {})
    heat = [Film(between=("lower", "upper"), closure="medium")]
    return Scene(pair, interface, heat, {"v": Hold(level=v)}, None, 300.0, initial)


def solved(scene: Scene, *times: float, **changes: float):
    return Model(assemble(scene)).solve(Run(times=times), changes)


# -- fits -------------------------------------------------------------------------------------------------------------


def off(fluid, quantity, T, *asked):
    """Largest relative error of a fit at some temperatures."""
    pieces = fluid.fit(quantity, *asked)
    index = np.searchsorted([piece.high for piece in pieces], T)
    values = np.array([pieces[i](t) for i, t in zip(index, T, strict=True)])
    return np.max(np.abs(values / fluid.values(quantity, T) - 1))


@pytest.mark.parametrize(("name", "p", "low", "high"), FLUIDS, ids=[row[0] for row in FLUIDS])
def test_fits_are_within_their_bound(name, p, low, high):
    fluid = CoolPropFluid(name, p)
    T = np.random.default_rng(7).uniform(low, high, 400)
    for quantity in PROPERTIES:
        if name.startswith("INCOMP") and quantity == "gamma_m":
            continue
        assert fluid.fit(quantity, low, high)[-1].high == high
        assert off(fluid, quantity, T, low, high) < BOUND, quantity


def test_kinks_and_jumps_lie_between_pieces():
    kinked = fits.fit(lambda T: 1 + np.abs(np.sin(T / 50 - 6.1)), 280.0, 330.0)
    jumping = fits.fit(lambda T: np.exp(T / 300) + (T > 311.7), 280.0, 330.0)
    assert min(abs(piece.high - 305.0) for piece in kinked) < 1e-4
    assert min(abs(piece.high - 311.7) for piece in jumping) < 1e-4


def test_what_is_not_smooth_is_refused():
    noise = np.random.default_rng(3)
    with pytest.raises(fits.NoFitError):
        fits.fit(lambda T: 1 + 1e-6 * noise.random(len(T)), 280.0, 330.0)


def test_beside_a_critical_pressure_a_message_says_what_to_do():
    told = CoolPropFluid("CarbonDioxide", 74e5).critical_remark()
    assert "critical pressure is 7.3773e+06 Pa" in told
    assert "as numbers under `interface.medium`" in told
    for other in (CoolPropFluid("CarbonDioxide", 1e7), CoolPropFluid("INCOMP::MEG-50%", 1e5)):
        assert other.critical_remark() == ""


def test_near_a_critical_point_a_fit_is_as_close_as_it_says():
    """CoolProp's heat capacity of carbon dioxide at 80 bar is not smooth at 306.64 K, where it is largest."""
    fluid = CoolPropFluid("CO2", 8e6)
    T = np.random.default_rng(7).uniform(306.5, 306.8, 400)
    assert off(fluid, "cp_m", T, 306.5, 306.8, fits.CRITICAL_ACCURACY) < 2 * fits.CRITICAL_ACCURACY


@dataclasses.dataclass(frozen=True)
class Bumpy(CoolPropFluid):
    """Water with bumps of one part in a million, as between the steps of a solver."""

    remark = "its use is told"

    def fit(self, quantity: str, low: float, high: float, target: float) -> tuple[fits.Piece, ...]:
        """As in CoolProp, but for its bumps."""
        bumps = lambda T: 1 + 5e-7 * np.sin(1e9 * T)  # noqa: E731
        try:
            return fits.fit(lambda T: self.values(quantity, T) * bumps(T), low, high, target)
        except fits.NoFitError as error:
            raise InputError(str(error)) from None


def test_how_close_a_fit_is_is_told_where_it_is_not_close():
    scene = lubricated(Medium(Bumpy("Water", 1e6), {}, 2e-6), capacity=False)
    warnings = " ".join(assemble(scene).warnings)
    assert "the viscosity of the medium is known within 2e-06 only between 273.2 and 330 K" in warnings
    assert "its use is told" in warnings


def test_what_a_mixture_costs_is_told():
    """Where it boils and condenses it is known which phase it has, and then it costs little."""
    assert "20 to 50 ms for each value" in CoolPropFluid("CarbonDioxide[0.9]&Nitrogen[0.1]", 1e7).remark
    assert CoolPropFluid("Methane[0.9]&Ethane[0.1]", 1e5).remark == ""


@pytest.mark.parametrize(
    ("name", "pressure"), [("Air.mix", 1e5), ("Water[0.5]&Ethanol[0.5]", 1e5), ("Methane[0.9]&Ethane[0.1]", 2e7)]
)
def test_a_mixture_has_the_properties_that_coolprop_finds_without_its_phase(name, pressure):
    from CoolProp.CoolProp import PropsSI  # reads all fluids for seconds

    fluid, T = CoolPropFluid(name, pressure), np.array([290.0, 320.0])
    for quantity, letter in (("rho_m", "D"), ("cp_m", "C")):
        known = PropsSI(letter, "T", T, "P", pressure, name)
        assert fluid.values(quantity, T) == pytest.approx(known, rel=1e-14)


@pytest.mark.parametrize("name", ["Water", "INCOMP::MEG-50%"])
def test_properties_in_the_compiled_code(name):
    scene = lubricated(medium(name))
    values = computed(solved(scene, *np.linspace(0.0, 2.0, 21)))
    exact = CoolPropFluid(name, 1e5)
    for quantity in ("k_m", "eta_m"):
        assert values[quantity] == pytest.approx(exact.values(quantity, values["T_c"]), rel=BOUND)
    assert values["t_film_shear"] == pytest.approx(values["eta_m"] * values["v"] / 2e-6, rel=1e-12)


# -- heat made across a film ------------------------------------------------------------------------------------------

K_M, ETA, D_M = 0.13, 0.01, 5e-6


def between_walls(T_1, T_2, v, viscosity=ETA, law=Film, given=None, **parameters) -> Scene:
    """A film of constant conductivity that is sheared between walls of constant temperature."""
    properties = {"k_m": K_M, "rho_m": 860.0, "cp_m": 2000.0, "eta_m": ETA} if given is None else given
    friction = FilmShear() if viscosity is ETA else Viscous(eta=viscosity)
    found = Medium(None, properties, D_M)
    interface = Interface("T_c", [ConstantInterfaceCapacity(C_c=8.6)], [friction], medium=found)
    walls = Body("lower", Hold(level=T_1)), Body("upper", Hold(level=T_2))
    heat = [law(between=("lower", "upper"), closure="medium", **parameters)]
    loading = {"v": Hold(level=v)} | ({} if viscosity is ETA else {"g_n": Hold(level=D_M)})
    return Scene(walls, interface, heat, loading, T_0=300.0, initial={"T_c": 300.0})


def steady(scene: Scene) -> dict[str, float]:
    return {name: values[-1] for name, values in computed(solved(scene, 0.0, 0.02)).items()}


@pytest.mark.parametrize(("T_1", "T_2", "v"), [(300.0, 340.0, 30.0), (390.0, 310.0, 0.5)])
def test_a_sheared_film_against_couette_flow(T_1, T_2, v):
    """The parabola on a line that solves k T'' + eta (v/d)^2 = 0."""
    values, heat = steady(between_walls(T_1, T_2, v)), ETA * v**2 / D_M
    across = K_M / D_M * (T_2 - T_1)
    assert values["T_c"] == pytest.approx((T_1 + T_2) / 2 + ETA * v**2 / (12 * K_M), rel=1e-11)
    assert values["q_1"] == pytest.approx(heat / 2 + across, rel=1e-9)
    assert values["q_2"] == pytest.approx(heat / 2 - across, rel=1e-9)
    profile = np.linspace(0.0, 1.0, 20001)
    T = T_1 + (T_2 - T_1) * profile + ETA * v**2 / (2 * K_M) * profile * (1 - profile)
    assert values["T_c"] == pytest.approx(np.trapezoid(T, profile), rel=1e-8)


def test_heat_made_across_a_gas_passes_the_jump_at_each_wall():
    T_1, T_2, d = 300.0, 320.0, 1e-7
    given = {"alpha_1": 0.9, "alpha_2": 0.2}
    scene = between_walls(T_1, T_2, 200.0, law=RarefiedFilm, given={}, **given)
    within = dataclasses.replace(scene.interface, medium=medium("Nitrogen", 1e5, d))
    values = steady(dataclasses.replace(scene, interface=within))
    fluid, T_c = CoolPropFluid("Nitrogen", 1e5), values["T_c"]
    gas = {name: float(fluid.values(name, np.array([T_c]))[0]) for name in ("k_m", "eta_m", "rho_m", "cp_m", "gamma_m")}
    law = RarefiedFilm(between=("lower", "upper"), **given)
    r_1, r, r_2 = law.resistances(**gas, p_m=1e5, d_m=d)
    # T = level + slope y - heat r y^2 / 2 across the film; at each wall the flux passes the resistance of the jump.
    heat = gas["eta_m"] * 200.0**2 / d
    jumps = [[1.0, -r_1 / r], [1.0, 1.0 + r_2 / r]]
    level, slope = np.linalg.solve(jumps, [T_1, T_2 + heat * (r / 2 + r_2)])
    assert T_c == pytest.approx(level + slope / 2 - heat * r / 6, rel=1e-8)
    assert values["q_1"] == pytest.approx(slope / r, rel=1e-6)
    assert values["q_2"] == pytest.approx(heat - slope / r, rel=1e-6)


@pytest.mark.parametrize("T_c", [250.0, 345.0, 700.0])
def test_a_film_produces_entropy_whatever_its_temperature(T_c):
    scene = dataclasses.replace(between_walls(250.0, 450.0, 0.0), initial={"T_c": T_c})
    assert np.all(computed(solved(scene, 0.0, 1e-6, 1e-4, 1e-2))["sigma_film"] > 0)


# -- how far a run may go ----------------------------------------------------------------------------------------------


def test_a_run_may_reach_any_temperature_at_which_the_fluid_stays_what_it_is():
    model = Model(assemble(lubricated(medium("Nitrogen"), v=60.0)))
    trajectory = model.solve(Run(times=np.linspace(0.0, 8.0, 9)))
    assert trajectory.status == "finished"
    values = computed(trajectory)
    assert values["T_c"][-1] > 420.0
    exact = CoolPropFluid("Nitrogen", 1e5).values("eta_m", values["T_c"])
    assert values["eta_m"] == pytest.approx(exact, rel=BOUND)


FREEZING = [
    ("Water", 100.0, 300.0, 273.16),  # as vapour, which does not come to the triple point
    ("Argon", 5e4, 90.0, 83.806),
    ("Methane", 5e8, 200.0, 186.58077),
    ("INCOMP::MEG-50%", 1e5, 239.0, 237.15558),
    ("Nitrogen", 101325.0, 64.0, 63.17055),
    ("R134a", 1e5, 200.0, 169.85),
    ("CO2", 8e8, 340.0, 327.67310),
]


@pytest.mark.parametrize(("fluid", "p", "T", "low"), every(3, FREEZING))
def test_properties_end_where_the_fluid_freezes(fluid, p, T, low):
    found = CoolPropFluid(fluid, p)
    span = found.range(T)
    assert span.low == pytest.approx(low, rel=1.1e-5)
    for quantity in ("eta_m", "rho_m"):
        assert off(found, quantity, np.linspace(span.low, T, 7), span.low, min(2 * T, span.high)) < BOUND


def test_an_algebraic_temperature_far_from_its_guess_is_found():
    scene = lubricated(medium("Nitrogen", thickness=5e-4), v=870.0, capacity=False)
    trajectory = solved(scene, 0.0, 1.0)
    values = computed(trajectory)
    assert values["T_c"][0] > 340.0
    exact = CoolPropFluid("Nitrogen", 1e5)
    for quantity in ("k_m", "eta_m"):
        assert values[quantity] == pytest.approx(exact.values(quantity, values["T_c"]), rel=BOUND)


def test_a_liquid_that_boils_ends_the_run():
    trajectory = solved(lubricated(medium(), v=20.0), 0.0, 1.0, 5.0)
    assert trajectory.status == "stopped"
    assert trajectory.reason.startswith("Water at 100000 Pa boils at T_c = 372.752 K")


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fluid", "p", "T", "message"),
    [
        ("Propyne", 5e5, 300.0, "Propyne at 500000 Pa: Viscosity model is not available for this fluid"),
        ("Water", 1e5, 250.0, "Water at 100000 Pa has no properties at 250 K: CoolProp's range is 273.16 to 2000 K"),
        pytest.param(
            *("Methane", 5e8, 200.0),
            r"the conductivity of Methane .* The case is at 200 K, and needs it from 186.6 to 220 K",
            marks=pytest.mark.slow,
        ),
        ("INCOMP::MEG-50%", 1e5, 237.0, "INCOMP::MEG-50% at .* no properties at 237 K: .* 237.158 to 373.15 K"),
        ("Watr", 1e5, 300.0, "CoolProp knows no fluid 'Watr'. Did you mean 'Water'?"),
    ],
)
def test_what_coolprop_has_not_is_refused_with_the_reason(fluid, p, T, message):
    with pytest.raises(InputError, match="^" + message.replace("?", r"\?")):
        assemble(lubricated(medium(fluid, p), T=T))


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (
            Medium(None, {"eta_m": 0.1, "rho_m": 800.0, "cp_m": 2e3}, 1e-6),
            "reads the thermal conductivity of the medium k_m",
        ),
        (Medium(None, {"eta_m": 0.1, "k_m": 0.1, "rho_m": 800.0}, 1e-6), "needs the density and the heat capacity"),
        (Medium(CoolPropFluid("Water", 1e5), {}, None), "a film that stores heat needs a thickness"),
        (Medium(growth=(FilmWear(L=1.0),)), "d_m evolves but has no initial value. Add `d_m:` under `initial`"),
    ],
)
def test_a_medium_that_lacks_what_is_asked_for(found, message):
    scene = lubricated(found)
    scene = dataclasses.replace(scene, loading={**scene.loading, "g_n": Hold(level=1e-6)})
    with pytest.raises(InputError, match=message):
        assemble(scene)


TEXT = """
bodies: {lower: {temperature: T_1, C: 500}, upper: {temperature: T_2, C: 500}}
T_0: 300
interface: {temperature: T_c, medium: {%s}, friction: [film-shear]}
heat: [film: {between: [lower, upper], closure: medium}]
loading: {v: 2, g_n: 1 um}
initial: {T_1: 300, T_2: 300}
run: {until: 1}
"""


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("fluid: Watr, pressure: 1 atm", "case.yaml:4: interface.medium.fluid: CoolProp knows no fluid 'Watr'"),
        ("fluid: Water", "case.yaml:4: interface.medium: the fluid needs a `pressure`"),
        ("pressure: 1 atm", "case.yaml:4: interface.medium.pressure: `pressure` belongs to a fluid"),
        ("conductivity: {vogel: {a: 1, b: 1, c: 1}}", "vogel is a law of the viscosity of the medium, not of the cond"),
        ("viscosity: 3 m", "viscosity"),
        ("thickness: 1 um, growth: [film-wear: {L: 1}]", "medium.thickness: the film grows: give its thickness at the"),
        ("viscosty: 3", "unknown key 'viscosty'. Did you mean 'viscosity'?"),
    ],
)
def test_media_of_case_files_that_are_wrong(content, message):
    with pytest.raises(InputError) as caught:
        case.load_text(TEXT % content)
    assert message in str(caught.value)


# -- laws -------------------------------------------------------------------------------------------------------------


def test_a_property_that_is_given_goes_before_that_of_the_fluid():
    found = Medium(CoolPropFluid("Water", 1e5), {"eta_m": Vogel(a=6e-5, b=900.0, c=165.0)}, 2e-6)
    values = computed(solved(lubricated(found, v=0.5), 0.0, 1.0))
    assert values["eta_m"] == pytest.approx(6e-5 * np.exp(900.0 / (values["T_c"] - 165.0)), rel=1e-12)
    assert values["k_m"] == pytest.approx(CoolPropFluid("Water", 1e5).values("k_m", values["T_c"]), rel=BOUND)


def test_a_gas_film_in_contact_keeps_the_thickness_of_the_voids():
    gap = surfacechem.load("closing-gas-gap", {"loading.g_n": "1 um", "run.outputs": 5})
    pressed, apart = (gap.run({"loading.g_n": g, "heat.rarefied-film.Y": Y}) for g, Y in ((-1e-6, 2e-6), (1e-6, 1e-6)))
    assert pressed.status == "finished"
    np.testing.assert_allclose(pressed.dataset["T_1"], apart.dataset["T_1"], rtol=1e-9)


def test_a_run_that_reaches_the_pole_of_a_viscosity_stops():
    found = Medium(None, {"eta_m": Vogel(a=6e-5, b=90.0, c=165.0), "k_m": 0.1}, 2e-6)
    scene = lubricated(found, v=0.0, T=170.0, capacity=False)
    cooled = {"Q_1": Hold(level=-2e3), "Q_2": Hold(level=-2e3)}
    trajectory = solved(dataclasses.replace(scene, loading={**scene.loading, **cooled}), 0.0, 10.0)
    assert trajectory.status == "stopped"
    assert "T_c left the range of the law vogel" in trajectory.reason


def test_the_pole_of_a_viscosity_is_that_of_the_run():
    oil, pole = surfacechem.load("lubricated-sliding"), "interface.medium.viscosity.vogel.c"
    with pytest.raises(InputError, match=r"T_c left the range of the law vogel, c to inf .*-86\.85"):
        oil.run({pole: 400.0})
    cold = {"loading.v": 0.0, "surroundings.temperature": 290.0, "initial.T_1": 295.0, "initial.T_2": 295.0}
    run = oil.run({pole: 300.0, "initial.T_c": 301.0, **cold})
    assert run.status == "stopped"
    assert float(run.dataset["T_c"].min()) > 300 - 1e-6


# -- nothing without need ---------------------------------------------------------------------------------------------


def test_a_medium_gives_only_what_is_asked_for():
    names = set(computed(simulation.load("lubricated-sliding").model.solve(Run(times=[0.0, 1.0]))))
    assert {"k_m", "eta_m"} <= {*names, "k_m"}
    assert not {"gamma_m", "p_m", "rho_m"} & names
    parameters = [p.path for p in assemble(lubricated(medium(), capacity=False)).parameters]
    assert not [path for path in parameters if "rho_m" in path or "cp_m" in path]


@pytest.mark.parametrize("T", [138.0, 100.0, 1e-3])
def test_roelands_is_a_number_beyond_its_pole(T):
    """A run stops at the pole; a value asked for beyond it is finite."""
    value = Roelands(eta_0=0.04, Z=0.6, S_0=1.1).value(T_c=T, p=1e8, T_0=313.15)
    assert 0 < value < 1


@pytest.mark.slow
def test_what_is_not_smooth_everywhere_is_fitted_around_the_start():
    """CoolProp's conductivity of methane has no polynomials somewhere below 625 K."""
    trajectory = solved(lubricated(medium("Methane", p=101325.0, thickness=5e-5), v=800.0), *np.linspace(0.0, 50.0, 3))
    assert trajectory.status == "stopped"
    assert "the properties of Methane are fitted no further (give `interface.medium.temperatures`" in trajectory.reason

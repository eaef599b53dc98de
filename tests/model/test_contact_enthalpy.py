"""Contact enthalpy per bonding site, and the class of a reaction by its heat."""

import numpy as np
import pytest

import surfacechem

CASE = """
title: bonds between bodies of one temperature
T_0: 300 K
bodies: {{a: {{temperature: 300 K}}, b: {{temperature: 300 K}}}}
interface:
  temperature: 300 K
  sites: 1e16 1/m^2
  potential: [{potential}]
  bonding: [linear-affinity: {{c_r: 1e19 1/J/s}}]
{load}
initial: {{phi: 0.2{more}}}
run: {{until: 20 s}}
"""
SPRINGS = "{bond-stiffness: {E_b: 1e13 Pa/m, E_n: 1e14 Pa/m}}, {lattice-gas: {epsilon: 2e-20 J}}"


def run(folder, potential, load="", more=""):
    path = folder / "case.yaml"
    path.write_text(CASE.format(potential=potential, load=load, more=more))
    return surfacechem.load(path).run()


@pytest.mark.parametrize(
    ("energy", "expected"),
    [
        ("K_0: 1 mJ/m^2", "exothermic"),
        ("K_0: 2 mJ/m^2, K_2: -1 mJ/m^2", "exothermic"),
        ("K_2: 1 mJ/m^2", "endothermic"),
        ("K_1: 1 mJ/m^2", "isothermic"),
        ("K_0: -1 mJ/m^2, K_1: 2 mJ/m^2", "endothermic"),
    ],
)
def test_the_class_of_a_reaction(energy, expected, tmp_path):
    """Bonds form in all of them, by the affinity; the heat that keeps the temperatures says the class."""
    solution = run(tmp_path, f"bond-energy: {{{energy}}}")
    data = solution.dataset
    assert solution.attributes["reaction"] == expected
    assert data["phi"][-1] > 0.5
    kept = -sum(data[name] for name in data if name.startswith("Q_T"))
    np.testing.assert_allclose(data["q_reaction"], kept, atol=1e-12)


def test_bonds_that_form_and_break_are_of_both_classes(tmp_path):
    path = tmp_path / "case.yaml"
    text = CASE.format(potential="bond-energy: {K_0: 1 mJ/m^2}", load="", more="")
    history = "loading: {phi: {table: {times: [0 s, 1 s, 2 s], values: [0.2, 0.8, 0.2]}}}"
    lines = [line for line in text.splitlines() if "bonding:" not in line and "initial:" not in line]
    body = "{temperature: T_1, C: 1 J/m^2/K}"
    path.write_text("\n".join(lines).replace("a: {temperature: 300 K}", f"a: {body}").replace("20 s", "2 s")
                    + f"\n{history}\ninitial: {{T_1: 300 K}}\n")  # fmt: skip
    solution = surfacechem.load(path).run()
    assert solution.attributes["reaction"] == "exothermic and endothermic"
    assert float(solution.dataset["e_c"][0]) == pytest.approx(0.5e-3 * 0.8**2 / 1e16, rel=1e-12)


@pytest.mark.parametrize("area", [1, 2])
def test_at_constant_traction_the_fall_of_the_enthalpy_is_the_heat_that_leaves(area, tmp_path):
    load = f"loading: {{F_n: 20 kPa, J_c: {area}}}"
    solution = run(tmp_path, SPRINGS, load, ", g_n: 5 nm")
    data = solution.dataset
    given = (
        data["H_T_c"]
        if "H_T_c" in data
        else sum(data[name] for name in data if name.startswith("H_") and not name.endswith("entropy"))
    )
    np.testing.assert_allclose(1e16 * (data["e_c"] - data["e_c"][0]), given, atol=1e-12)
    t_n = data["t_n_nominal"] if area == 2 else data["t_n"]
    np.testing.assert_allclose(1e16 * data["e_c"], data["U_c"] - t_n * data["g_n"], rtol=1e-12)
    np.testing.assert_allclose(t_n, 2e4, rtol=1e-9)


def test_where_nothing_bonds_there_is_no_enthalpy_of_bonds(tmp_path):
    data = surfacechem.run("sliding-dry")
    assert "e_c" not in data.dataset
    assert "reaction" not in data.attributes

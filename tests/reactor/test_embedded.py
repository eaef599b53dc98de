"""How the accounts of a scene follow from its states."""

import numpy as np
import pytest

from surfacechem.reactor import InterfaceReactor

COMBINED = {
    "dna-adhesive": {
        ("theta_free_s", "formed_theta_free_s"): 1.0,
        ("theta_free_s", "formed_theta_bond_s"): -1.0,  # as exact as by the other coverage
        ("T_1", "heat_into_1"): 2000.0,
        ("T_2", "heat_into_2"): 1000.0,
    },
    "sliding-dry": {("T", "entropy_coulomb"): (2000.0 + 2000.0 + 50.0) / 300.0},
    "stick-slip": {},
}


@pytest.mark.parametrize("case", COMBINED)
def test_fixed_combinations_of_the_rates_of_states(case):
    """Coverages, and heat capacities: constant ones of bodies, and one proportional to the temperature."""
    interface = InterfaceReactor(case)
    scene, found = interface.scene, interface.combined(0.0)
    names = {(scene.states[i], scene.accounts[j]): found[i, j] for i, j in zip(*np.nonzero(found), strict=True)}
    assert names == pytest.approx(COMBINED[case], rel=1e-9)

"""How the accounts of a scene follow from its states."""

import numpy as np
import pytest

import surfacechem
from surfacechem.reactor import InterfaceReactor, ReactorNet

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


def test_slip_turns_as_in_a_run():
    """What is brief in the run is so in a network, which has no end; tolerances of slips leave a small turn noise."""
    net = ReactorNet([pulled := InterfaceReactor("pulled-at-an-angle")])
    net.rtol, net.atol = 1e-8, 1e-12
    net.advance(0.05)
    end = surfacechem.run("pulled-at-an-angle", ["run.until=0.05 s"]).dataset
    assert pulled["turn"] == pytest.approx(float(end["turn"][-1]), rel=1e-6)

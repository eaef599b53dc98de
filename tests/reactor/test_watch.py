"""The quadrature along the steps of a network."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from surfacechem.reactor.watch import LESS_GAUSS, NODES, WEIGHTS


@pytest.mark.parametrize(("weights", "degree"), [(WEIGHTS, 11), (WEIGHTS - LESS_GAUSS, 5)])
def test_a_rule_is_exact_up_to_its_degree_and_no_further(weights, degree):
    exact = [Polynomial.basis(k).integ()(1) - Polynomial.basis(k).integ()(-1) for k in range(degree + 2)]
    found = [weights @ NODES**k for k in range(degree + 2)]
    assert found[:-1] == pytest.approx(exact[:-1], abs=1e-15)
    assert abs(found[-1] - exact[-1]) > 1e-4
    assert np.all(np.diff(NODES) > 0)

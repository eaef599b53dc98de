# %% [markdown]
# # A rupture-force spectrum with a law of one's own
#
# L-selectin holds a leukocyte by a bond with two barriers, one behind the other: Evans, Leung, Hammer & Simon (2001,
# doi 10.1073/pnas.061324998) read them off a spectrum with two slopes. No law of the package has two barriers in
# series, so this page writes one, in a dozen lines, and lets it give the spectrum.

# %%
import numpy as np

import surfacechem
from surfacechem.contracts.terms import RateLaw, parameter
from surfacechem.expressions import Expression, exp
from surfacechem.quantities import BOLTZMANN

# %% [markdown]
# ## The law
#
# The lifetime is the sum of the times that both barriers take, and a force shortens each by its own distance:
# $\tau(f)=e^{-fx_1/k_BT}/k_1+e^{-fx_2/k_BT}/k_2$. The names of the fields are the parameters, the arguments of `rate`
# are what it reads, and derivatives follow from the formula.


# %%
@surfacechem.register
class TwoBarriers(RateLaw):
    r"""Slip bond with two barriers in series.

    .. math:: R = -\frac{n_c\,\phi}{e^{-f x_1 / k_B T_c} / k_1 + e^{-f x_2 / k_B T_c} / k_2}

    Source: Evans (1998), Faraday Discuss. 111, 1, doi 10.1039/a809884k. While both barriers stand.
    """

    k_1: float = parameter("1/s", "rate over the outer barrier at no force", above=0)
    x_1: float = parameter("m", "distance to the outer barrier", at_least=0)
    k_2: float = parameter("1/s", "rate over the inner barrier at no force", above=0)
    x_2: float = parameter("m", "distance to the inner barrier", at_least=0)

    def rate(
        self, phi: Expression, n_c: Expression, f: Expression, T_c: Expression
    ) -> Expression:
        """Net rate [1/(m^2 s)]."""
        work = f / (BOLTZMANN * T_c)
        return (
            -n_c
            * phi
            / (exp(-work * self.x_1) / self.k_1 + exp(-work * self.x_2) / self.k_2)
        )


# %% [markdown]
# ## The spectrum
#
# With the values that the paper reads off its data, at loading rates over four decades.

# %%
case = surfacechem.load("""
title: L-selectin and PSGL-1, two barriers
interface:
  temperature: 25 degC
  bonding:
    - two-barriers: {k_1: 3 1/s, x_1: 0.4 nm, k_2: 100 1/s, x_2: 0.06 nm}
loading: {f: {ramp: {rate: 100 pN/s}}}
initial: {phi: 1}
run: {until: 1 s}
""")
rates = {"from": "10 pN/s", "to": "100 nN/s", "points": 33, "spacing": "logarithmic"}
spectrum = case.sweep({"loading.f.ramp.rate": rates}, {"f": "400 pN"})
spectrum.plot()

# %% [markdown]
# Two slopes, as measured: below some 40 pN the outer barrier decides, above it the inner one. The lifetimes that the
# runs tell, one curve for all rates, are those of the formula:

# %%
data = spectrum.dataset
work = data["f"].values / (BOLTZMANN * 298.15)
exact = np.exp(-work * 0.4e-9) / 3 + np.exp(-work * 0.06e-9) / 100
found = data["lifetime"].values
known = np.isfinite(found)
print(f"largest difference: {np.max(np.abs(found / exact - 1)[known]):.1e}")
assert np.allclose(found[known], np.broadcast_to(exact, found.shape)[known], rtol=1e-8)

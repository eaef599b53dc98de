# %% [markdown]
# # A contact element verified point by point
#
# Who writes a contact element codes tractions, heat fluxes and their tangent by hand, and has to show that they are
# right. This notebook holds such an element, thirty lines of NumPy with every derivative written out, against
# surfacechem at random states. There is no run: a scene in which everything is prescribed is evaluated at the states
# that one asks for, and its derivatives are exact.

# %%
import numpy as np

import surfacechem

# %% [markdown]
# ## The element
#
# Springs of the bonds in tension, a penalty in compression, dry friction, and heat that passes from either body to the
# interface: Sauer, Duong & Mandadapu (2021), section 5.

# %%
# Pa/m, Pa/m, 1, W/(m^2 K), W/(m^2 K)
E_b, E_n, mu, h_1, h_2 = 2e12, 50e12, 0.3, 100.0, 250.0
INPUTS = ("g_n", "v", "phi", "T_1", "T_2", "T_c")


def element(g_n, v, phi, T_1, T_2, T_c):
    """Normal and tangential traction, heat supplied to the interface and heat into each body, with the tangent."""
    stiffness = np.where(g_n < 0, E_n, phi * E_b)
    t_n = stiffness * g_n
    rub = np.where(g_n < 0, mu * E_n, 0.0)  # an open contact does not rub
    t_t = -rub * g_n * np.sign(v)
    values = {
        "t_n": t_n,
        "t_coulomb": t_t,
        "D_coulomb": t_t * v,
        "q_1": h_1 * (T_c - T_1),
        "q_2": h_2 * (T_c - T_2),
    }
    one = np.ones_like(g_n)
    tangent = {
        ("t_n", "g_n"): stiffness,
        ("t_n", "phi"): np.where(g_n < 0, 0.0, E_b * g_n),
        ("t_coulomb", "g_n"): -rub * np.sign(v),
        ("D_coulomb", "g_n"): -rub * np.abs(v),
        ("D_coulomb", "v"): t_t,
        ("q_1", "T_1"): -h_1 * one,
        ("q_1", "T_c"): h_1 * one,
        ("q_2", "T_2"): -h_2 * one,
        ("q_2", "T_c"): h_2 * one,
    }
    return values, tangent


# %% [markdown]
# ## The same contact as a scene

# %%
SCENE = """
title: The contact of the element
bodies:
  lower: {temperature: 300 K}
  upper: {temperature: 320 K}
interface:
  temperature: 310 K
  potential:
    - bond-stiffness: {E_b: 2 MPa/um, E_n: 50 MPa/um}
  friction:
    - coulomb: {mu: 0.3}
heat:
  - conductance: {between: [lower, interface], h: 100 W/m^2/K}
  - conductance: {between: [upper, interface], h: 250 W/m^2/K}
loading: {g_n: -1 nm, v: 1 mm/s, phi: 0.5}
"""
scene = surfacechem.load(SCENE)

# %% [markdown]
# ## A thousand states

# %%
rng = np.random.default_rng(1)
ranges = {
    "g_n": (-5e-9, 5e-9),
    "v": (-1e-2, 1e-2),
    "phi": (0, 1),
    "T_1": (280, 320),
    "T_2": (280, 320),
    "T_c": (280, 320),
}
points = {name: rng.uniform(*span, 1000) for name, span in ranges.items()}
truth = scene.evaluate(points)
print(
    f"{len(truth)} quantities at {truth.sizes['point']} points; all admissible: {bool(truth.admissible.all())}"
)

# %%
values, tangent = element(**{name: points[name] for name in INPUTS})


def distance(mine, theirs):
    """Largest difference, relative to the largest value."""
    return float(np.max(np.abs(mine - theirs)) / max(np.max(np.abs(theirs)), 1e-300))


for name, mine in values.items():
    print(
        f"{name:17} [{truth[name].units:9}]  {distance(mine, truth[name].values):.1e}"
    )
for (of, by), mine in tangent.items():
    slope = truth[f"{of}_by_{by}"]
    name = f"d{of}/d{by}"
    print(f"{name:17} [{slope.units:9}]  {distance(mine, slope.values):.1e}")

# %% [markdown]
# What the element leaves out of its tangent is zero in truth, too: a derivative that is not in the dataset is one that
# no formula has.

# %%
known = {f"{of}_by_{by}" for of, by in tangent}
forgotten = [
    f"{of}_by_{by}" for of in values for by in INPUTS if f"{of}_by_{by}" in truth
]
forgotten = [
    name for name in forgotten if name not in known and np.any(truth[name] != 0)
]
assert not forgotten, forgotten
assert max(distance(mine, truth[name].values) for name, mine in values.items()) < 1e-13
assert (
    max(
        distance(mine, truth[f"{of}_by_{by}"].values)
        for (of, by), mine in tangent.items()
    )
    < 1e-13
)

# %% [markdown]
# A tangent with an error shows at once. Without its factor $\phi$ the stiffness of the bonds would still pass a test
# with complete bonding; here it does not:

# %%
wrong = np.where(points["g_n"] < 0, E_n, E_b)
print(
    f"distance with the factor forgotten: {distance(wrong, truth['t_n_by_g_n'].values):.1e}"
)

# %% [markdown]
# The command line does the same with a table: `surfacechem evaluate contact.yaml points.csv -o truth.csv` reads states
# from columns headed `g_n [nm], T_1 [degC]` and writes every quantity and derivative with its unit.

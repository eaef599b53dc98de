# %% [markdown]
# # Exothermic and endothermic bonding
#
# Two bodies in perfect thermal contact bond. In the first case the bond energy is released as heat, in the second it is
# taken from the bodies. Sauer, Duong & Mandadapu (2021), sections 6.2.1 and 6.2.2, give both in closed form. This
# notebook runs the two cases, opens the netCDF files with plain `xarray`, and compares them with the formulas of the
# paper, written out here by hand.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray

import surfacechem

folder = Path(tempfile.mkdtemp())
for name in ("exothermic", "endothermic"):
    solution = surfacechem.run(name, ["run.outputs=201"])  # both at the same times
    print(f"{name}: {solution.status}, {solution.reason}")
    solution.write(folder / f"{name}.nc")

# %% [markdown]
# From here on surfacechem is not used. The files are ordinary netCDF.

# %%
exothermic = xarray.open_dataset(folder / "exothermic.nc")
endothermic = xarray.open_dataset(folder / "endothermic.nc")
print(exothermic)

# %% [markdown]
# The case is in its file:

# %%
print(endothermic.attrs["case"])

# %% [markdown]
# ## The formulas of the paper
#
# With equal bodies, $C_1=C_2=C_k$, and no capacity of the interface,
#
# $$\phi=1-e^{-t/\tau},\qquad \kappa=\frac{K}{2T_0C_k},$$
#
# exothermic ($K=K_0$, constant $c_r$):
#
# $$T=T_0\sqrt{1+\kappa\left(1-e^{-2t/\tau}\right)},\qquad q_m=\frac{K_0}{2\tau}e^{-2t/\tau},$$
#
# endothermic ($K=K_2T^2/T_0^2$, $c_r\propto T^{-2}$):
#
# $$T=T_0\sqrt{\frac{1-\kappa}{1-\kappa e^{-2t/\tau}}},\qquad
# q_m=-\frac{K_2}{2\tau}\,\frac{1-\kappa}{\left(1-\kappa e^{-2t/\tau}\right)^2}\,e^{-2t/\tau}.$$

# %%
T_0, C_k, K, N_c = 300.0, 1.0, 300.0, 1e18  # K, J/(m^2 K), J/m^2, 1/m^2
c_r = 6.6666666666666667e15  # 1/(J s)
tau = N_c / (c_r * K)
kappa = K / (2 * T_0 * C_k)
print(f"tau = {tau:.3f} s, kappa = {kappa:.3f}")

t = exothermic["time"].values
decay = np.exp(-2 * t / tau)
phi = 1 - np.exp(-t / tau)
exact = {
    "exothermic": {
        "phi": phi,
        "T": T_0 * np.sqrt(1 + kappa * (1 - decay)),
        "q_m": K / (2 * tau) * decay,
    },
    "endothermic": {
        "phi": phi,
        "T": T_0 * np.sqrt((1 - kappa) / (1 - kappa * decay)),
        "q_m": -K / (2 * tau) * (1 - kappa) / (1 - kappa * decay) ** 2 * decay,
    },
}
runs = {"exothermic": exothermic, "endothermic": endothermic}

# %% [markdown]
# ## Temperature and heat flux

# %%
colours = {"exothermic": "#d55e00", "endothermic": "#0072b2"}
figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
for name, run in runs.items():
    for ax, variable in zip(axes, ("T", "q_m"), strict=True):
        ax.plot(run["time"], run[variable], color=colours[name], label=name)
        ax.plot(t[::10], exact[name][variable][::10], "k.", markersize=4, label="_")
axes[0].set(xlabel="time [s]", ylabel="temperature [K]")
axes[1].set(xlabel="time [s]", ylabel=r"mean heat flux into the bodies [W/m$^2$]")
axes[0].legend(frameon=False)
for ax in axes:
    ax.grid(alpha=0.25)
    ax.spines[["top", "right"]].set_visible(False)

# %% [markdown]
# Lines are the runs, dots the formulas. The exothermic case ends at $T_0\sqrt{1+\kappa}$, the endothermic one at
# $T_0\sqrt{1-\kappa}$.

# %%
print(float(exothermic["T"][-1]), T_0 * np.sqrt(1 + kappa))
print(float(endothermic["T"][-1]), T_0 * np.sqrt(1 - kappa))

# %% [markdown]
# ## Error

# %%
figure, axes = plt.subplots(1, 2, figsize=(9, 3.2), sharey=True, layout="constrained")
axes[0].set_ylabel("error / largest value")
for ax, (name, run) in zip(axes, runs.items(), strict=True):
    for variable, style in (("T", "-"), ("phi", "--"), ("q_m", ":")):
        error = (
            np.abs(run[variable].values - exact[name][variable])
            / np.abs(exact[name][variable]).max()
        )
        ax.semilogy(
            t, np.maximum(error, 1e-17), style, color=colours[name], label=variable
        )
        print(f"{name:12} {variable:4} {error.max():.1e}")
        assert error.max() < 1e-8
    ax.set(title=name, xlabel="time [s]")
    ax.grid(alpha=0.25)
    ax.legend(loc="lower center", ncols=3)
    ax.set_ylim(bottom=1e-19)
# %% [markdown]
# Both cases run at the default tolerance. The files say what was found against the package's own exact solutions, and
# how well the balances close:

# %%
for name, run in runs.items():
    print(
        f"{name}: error {run.error:.1e}, energy {run.energy_error:.1e}, entropy {run.entropy_error:.1e}"
    )

# %% [markdown]
# ## The second law
#
# The reaction produces entropy in both directions of heat. The endothermic case cools both bodies, so their own entropy
# falls; that of the interface rises by more.

# %%
for name, run in runs.items():
    total = float(run["S_total"][-1] - run["S_total"][0])
    produced = float(run["entropy_linear_affinity"][-1])
    print(
        f"{name}: total entropy changed by {total:.6f}, produced {produced:.6f} J/(m^2 K)"
    )
    assert float(run["least_sigma_linear_affinity"]) > 0

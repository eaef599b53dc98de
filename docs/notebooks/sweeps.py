# %% [markdown]
# # Many runs: a spectrum, a process window, a sample
#
# Three uses of [sweeps](../sweeps.md), each a few lines.

# %%
import tempfile
from pathlib import Path

import numpy as np

import surfacechem
from surfacechem import plots

folder = Path(tempfile.mkdtemp())

# %% [markdown]
# ## The force at rupture over seven decades of loading rate
#
# Every run pulls until all bonds are broken; coloured points are the runs, black dots the exact formulas.

# %%
rates = {"from": "0.01 pN/s", "to": "100 nN/s", "points": 29, "spacing": "logarithmic"}
spectrum = surfacechem.sweep(
    "force-spectroscopy", {"loading.f.ramp.rate": rates}, {"f": "200 pN"}
)
print(f"largest error of the force: {spectrum.dataset.attrs['error']:.1e}")
plots.figure(spectrum.dataset)

# %% [markdown]
# ## A process window
#
# A joint bonds and heats itself: which bond energy and which rate coefficient give 95 % of the bonds, when, and how hot
# does it become? White is where that is not reached within the run.

# %%
window = surfacechem.load(
    "exothermic",
    {
        "sweep": {
            "over": {
                "interface.potential.bond-energy.K_0": {
                    "from": "20 J/m^2",
                    "to": "300 J/m^2",
                    "points": 30,
                },
                "interface.bonding.linear-affinity.c_r": {
                    "from": "1e15 1/J/s",
                    "to": "2e16 1/J/s",
                    "points": 25,
                    "spacing": "logarithmic",
                },
            },
            "keep": {"max": ["T"], "reach": {"phi": 0.95}},
            "checked": 20,
        }
    },
)
stream = window.stream(window.plan(), folder / "window.zarr")
stored = stream.run()
print("error", stream.check())
plots.figure(stored.dataset, ["time_to_phi", "T_max"])

# %% [markdown]
# ## A sample of uncertain parameters
#
# Ten thousand draws go through the compiled loop as arrays into a store, which is opened without being read.

# %%
of = {
    "interface.potential.bond-energy.K_0": {
        "normal": {"mean": "250 J/m^2", "std": "25 J/m^2"}
    },
    "interface.bonding.linear-affinity.c_r": {
        "lognormal": {"median": "6.7e15 1/J/s", "sigma": 0.3}
    },
    "initial.T": {"uniform": {"from": "290 K", "to": "310 K"}},
}
section = {
    "sample": {"of": of, "runs": 10_000},
    "keep": {"last": ["T", "phi"], "reach": {"phi": 0.5}},
    "checked": 0,
}
case = surfacechem.load("exothermic", {"sweep": section})
data = case.stream(case.plan(), folder / "drawn.zarr").run().dataset
late = float(np.nanpercentile(data["time_to_phi"], 95))
print(
    f"{data.sizes['run']} runs; half of the bonds within {late:.3f} s in 95 % of them"
)
plots.figure(data)

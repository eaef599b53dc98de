# %% [markdown]
# # The integral, the local law and Derjaguin
#
# Two bodies whose points interact pull at each other over their whole surfaces. Three ways lead to the force. The
# *integral* sums the energy of pairs of points over both surfaces, Sauer, Duong & Mandadapu (2021), eq. e:bt_lr. The
# *local law* takes the traction between flats at the gap to the nearest point, eq. e:bt_sr, and integrates that over
# one surface. *Derjaguin* takes the energy between flats at the least gap times $2\pi R$. How far are they apart?

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

from surfacechem.laws.longrange import InversePower
from surfacechem.surfaces.forces import between_flats, interaction, over_gap
from surfacechem.surfaces.projection import Surface
from surfacechem.surfaces.shapes import Cavity, Paraboloid, Plane, Sphere

law = InversePower(n_1=1.0, n_2=1.0, psi_0=-1.0, r_0=1.0, m=6)
flats = between_flats(law)

# %% [markdown]
# ## A sphere over a plane
#
# For a power $r^{-m}$ the integral is a closed form, here for $R = 1$. Numbers are in units of the radius and of the
# strength of the pair.

# %%
gaps = np.geomspace(1e-3, 1.0, 9)


def three(shapes, radius, gap):
    """Force by the integral, by the local law and after Derjaguin, tension positive."""
    lower, upper = Surface(shapes[0]), Surface(shapes[1], True, gap)
    local = over_gap(lower, upper, [flats])
    derjaguin = -2 * math.pi * radius * flats(np.array([gap]))[0, 0]
    return interaction(lower, upper, [law]).force_1[0, 2], local.force_1[2], derjaguin


def closed(gap, m=6):
    """Force of a sphere of radius one over a plane."""
    return 4 * math.pi**2 / (m - 2) * (gap ** (2 - m) - (gap + 2) ** (2 - m))


forces = np.array([three((Sphere(R=1.0), Plane()), 1.0, gap) for gap in gaps])
exact = np.array([closed(gap) for gap in gaps])
print(f"the integral is off by {abs(forces[:, 0] / exact - 1).max():.1e}")
assert abs(forces[:, 0] / exact - 1).max() < 1e-9

# %% [markdown]
# What a point of the sphere feels of an endless plane is what it feels of a flat, so that the local law, integrated
# over the sphere, is exact. Derjaguin leaves out the far side of the sphere.

# %%
figure, ax = plt.subplots(figsize=(5.6, 3.6), layout="constrained")
ax.semilogx(gaps, forces[:, 0] / forces[:, 2], label="integral")
ax.semilogx(gaps, forces[:, 1] / forces[:, 2], "--", label="local law")
ax.axhline(1.0, linestyle=":", color="black", label="Derjaguin")
ax.set(
    xlabel="gap / radius",
    ylabel="force / that after Derjaguin",
    title="Sphere over a plane",
)
ax.legend()
ax.grid(alpha=0.3)

# %% [markdown]
# ## Other pairs
#
# Between two curved surfaces it is not: each point sees the other surface bend. $R$ is that of the sum of both
# curvatures at the nearest point.
# What the local law misses falls like the gap over the radius; Derjaguin is the limit of both.

# %%
pairs = {
    "two spheres": ((Sphere(R=1.0), Sphere(R=1.0)), 0.5),
    "sphere in a cavity": ((Sphere(R=1.0), Cavity(R=3.0)), 1.5),
    "paraboloid, sphere": ((Paraboloid(R=1.0), Sphere(R=1.0)), 0.5),
}
figure, ax = plt.subplots(figsize=(5.6, 3.6), layout="constrained")
print("difference at a gap of a thousandth of the radius, and its power of the gap")
print(f"{'':20s}{'local law':18s}Derjaguin")
for (name, (shapes, radius)), width in zip(pairs.items(), (3.5, 1.5, 1.5), strict=True):
    found = np.array([three(shapes, radius, gap) for gap in gaps])
    off = abs(found[:, 1:] / found[:, :1] - 1)
    powers = np.log(off[2] / off[0]) / np.log(gaps[2] / gaps[0])
    (line,) = ax.loglog(gaps, off[:, 0], linewidth=width, label=name)
    ax.loglog(gaps, off[:, 1], ":", color=line.get_color())
    print(
        f"{name:20s}"
        + "    ".join(f"{a:.1e} ({n:.3f})" for a, n in zip(off[0], powers, strict=True))
    )
    assert off[0, 1] < 0.01
ax.loglog(gaps, gaps, "--", color="0.4", linewidth=0.8, label="gap / radius")
ax.set(
    xlabel="gap / radius",
    ylabel="difference to the integral",
    title="Local law, and Derjaguin dotted",
)
ax.legend()
ax.grid(alpha=0.3)

# %% [markdown]
# ## In a run
#
# A case with `surface:` integrates the force once and then drives any gap model. The dataset keeps the integral,
# `force`, and how far the local law is from it, `local_difference`, at some approaches.

# %%
import surfacechem

run = surfacechem.run("ball-in-a-socket").dataset
rows = zip(
    run.approach.values * 1e9,
    run.force.values * 1e9,
    run.local_difference / run.force,
    strict=True,
)
for approach, force, off in rows:
    print(f"{approach:6.3f} nm  {force:9.5f} nN  local law {off:+.1%}")

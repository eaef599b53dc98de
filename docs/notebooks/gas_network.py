# %% [markdown]
# # An interface in a gas network
#
# A glass plate is glued to a chamber by DNA bonds. Hot air is blown through the chamber; it warms the glue and the
# plate, and the bonds melt. Then the feed is turned to cold air, and they form again. A case file knows bodies, an
# interface and what is between them, but no gas that flows; so the interface is a case, and the gas is Cantera's.

# %%
import tempfile
from pathlib import Path

import cantera as ct
import matplotlib.pyplot as plt
import numpy as np

import surfacechem
from surfacechem.reactor import InterfaceReactor, ReactorNet

# %% [markdown]
# ## The interface
#
# The chamber has a temperature and nothing else, so that a reactor can take its place. Glass: 1.08 mm of borosilicate;
# glue: 10 um of hydrogel, mostly water, as in the case `dna-adhesive`. 100 W/(m² K) is typical of forced convection.

# %%
CASE = """
title: A glass plate glued to a chamber
T_0: 298.15 K
bodies:
  plate: {temperature: T_1, C: 2 kJ/m^2/K, capacity: constant}
  chamber: {temperature: 400 K}
interface:
  temperature: T_c
  potential:
    - constant-interface-capacity: {C_c: 42 J/m^2/K}
  mechanism: {file: dna-tethers.yaml, bonds: [bond(s)]}
heat:
  - conductance: {between: [plate, interface], h: 2100 W/m^2/K}
  - conductance: {between: [chamber, interface], h: 100 W/m^2/K}
initial: {T_1: 298.15 K, T_c: 298.15 K, coverages: {bond(s): 0.99, free(s): 0.01}}
run: {until: 50 s}
"""
case = Path(tempfile.mkdtemp()) / "plate.yaml"
with case.open("w", encoding="utf-8") as file:
    print(CASE, file=file)

# %% [markdown]
# ## The network
#
# A stirred chamber of two litres, fed from a hot and from a cold reservoir, with a valve to the outside.


# %%
def network(flow, hot_until):
    """A chamber that is fed with air of 400 K until a time, then with air of 298.15 K, and the plate on its wall."""
    air = ct.Solution("air.yaml")
    air.TP = 298.15, ct.one_atm
    chamber = ct.IdealGasReactor(air, clone=True, volume=0.002)
    cold, outside = ct.Reservoir(air, clone=True), ct.Reservoir(air, clone=True)
    air.TP = 400.0, ct.one_atm
    hot = ct.Reservoir(air, clone=True)
    feed = ct.MassFlowController(
        hot, chamber, mdot=lambda t: flow if t < hot_until else 0.0
    )
    other = ct.MassFlowController(
        cold, chamber, mdot=lambda t: 0.0 if t < hot_until else flow
    )
    for source in (feed, other):
        ct.PressureController(chamber, outside, primary=source, K=1e-5)
    plate = InterfaceReactor(case, area=0.01, bodies={"chamber": chamber})
    net = ReactorNet([chamber, plate])
    net.rtol = 1e-9
    return net, chamber, plate


# %%
times = np.linspace(2, 100, 50)
net, chamber, plate = network(flow=0.005, hot_until=50.0)
gas = []
for stage in np.split(times, 2):
    for t in stage:
        net.advance(t)
        gas.append(chamber.T)
    net.reinitialize()  # the feed jumps
history = plate.dataset
print(
    f"least bonding state {float(history.phi.min()):.3f}, at the end {float(history.phi[-1]):.3f}"
)
print(f"energy of the interface closed to {history.attrs['energy_error']:.1e}")
assert history.phi.min() < 0.05
assert history.phi[-1] > 0.5

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 2.8), layout="constrained")
left.plot(times, gas, label="gas", color="0.6")
left.plot(history.time, history.T_1, label="plate")
left.set(xlabel="time [s]", ylabel="temperature [K]")
left.legend()
right.plot(history.time, history.phi)
right.set(xlabel="time [s]", ylabel="closed bonds")
right.grid(alpha=0.3)

# %% [markdown]
# ## The same without the network
#
# The more gas flows, the closer is the chamber to a reservoir of 400 K, and that is what the case file alone describes.
# The difference falls as one over the flow.

# %%
alone = surfacechem.run(case).dataset
for flow in (0.05, 5.0):
    net, chamber, plate = network(flow, hot_until=np.inf)
    net.advance(50.0)
    print(
        f"{flow:5g} kg/s: plate {plate['T_1']:.4f} K, of the case {float(alone.T_1[-1]):.4f} K"
    )
assert abs(plate["T_1"] - float(alone.T_1[-1])) < 0.01

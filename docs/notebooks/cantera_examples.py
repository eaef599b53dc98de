# %% [markdown]
# # Three examples of Cantera
#
# A packed bed, a diamond that grows, an electrode: three of the examples that come with Cantera, once as its users
# write them and once as a case of this package. Numbers are compared point by point.

# %%
import tempfile
from pathlib import Path

import cantera as ct
import matplotlib.pyplot as plt
import numpy as np

import surfacechem
from surfacechem.reactor import InterfaceReactor, ReactingGas, ReactorNet

folder = Path(tempfile.mkdtemp())

# %% [markdown]
# ## A packed bed: `surf_pfr_chain`
#
# Partial oxidation of methane on platinum at 800 °C. The bed is a chain of stirred reactors, each fed by the one
# before; since nothing runs upstream, one after the other is integrated for three seconds, to its steady state. The
# catalyst is Cantera's `ReactorSurface`, or a case beside a `ReactingGas`.

# %%
T, LENGTH, COUNT = 1073.15, 3e-3, 4
VOLUME, CATALYST = (
    1e-4 * 0.3 * LENGTH / (COUNT - 1),
    1e5 * 1e-4 * 0.3 * LENGTH / (COUNT - 1),
)

BED = """
bodies: {wall: {temperature: 1073.15 K}, core: {temperature: 1073.15 K}}
interface:
  temperature: 1073.15 K
  mechanism:
    file: methane_pox_on_pt.yaml
    phase: Pt_surf
    neighbours: {gas: {pressure: 1 atm, composition: {CH4: 0.4, O2: 0.55}, rest: AR}}
initial: {coverages: {PT(S): 1}}
run: {until: 1 s, solver: cantera}
"""
(folder / "bed.yaml").write_text(BED, encoding="utf-8")


def bed(ours):
    """Mole fractions at the end of each reactor."""
    surface = ct.Interface("methane_pox_on_pt.yaml", "Pt_surf")
    inlet = surface.adjacent["gas"]
    surface.TP, inlet.TPX = (T, ct.one_atm), (T, ct.one_atm, "CH4:1, O2:1.5, AR:0.1")
    kind = ReactingGas if ours else ct.IdealGasReactor
    gas = kind(inlet, clone=True, volume=VOLUME, energy="off")
    upstream, downstream = (
        ct.Reservoir(inlet, clone=True),
        ct.Reservoir(inlet, clone=True),
    )
    feed = ct.MassFlowController(
        upstream, gas, mdot=0.4 / 60 * inlet.density * 1e-4 * 0.3
    )
    ct.PressureController(gas, downstream, primary=feed, K=1e-6)
    if ours:
        catalyst = InterfaceReactor(
            folder / "bed.yaml", area=CATALYST, neighbours={"gas": gas}
        )
        net = ReactorNet([gas, catalyst])
    else:
        ct.ReactorSurface(surface, gas, A=CATALYST, clone=True)
        net = ct.ReactorNet([gas])
    net.rtol, net.atol = 1e-9, 1e-16
    found = []
    for n in range(COUNT):
        upstream.phase.TDY = gas.phase.TDY
        upstream.syncState()
        net.reinitialize()
        net.advance(3.0 * (n + 1))
        found.append(gas.phase["CH4", "H2", "CO"].X)
    return np.array(found)


ours, theirs = bed(True), bed(False)
x = np.linspace(0, LENGTH * 1e3, COUNT)
plt.plot(x, theirs, "k-", lw=0.5)
for name, values in zip(("CH4", "H2", "CO"), ours.T, strict=True):
    plt.plot(x, values, "o", label=name)
plt.xlabel("distance [mm]")
plt.ylabel("mole fraction")
plt.legend()
print(f"largest difference: {np.abs(ours - theirs).max():.1e}")
assert np.abs(ours - theirs).max() < 1e-8

# %% [markdown]
# ## Diamond from methyl and atomic hydrogen: `diamond_cvd`
#
# The rate of growth as the hydrogen in the gas becomes less. The composition is a key of the case, which a loop changes
# as in the example; the growth rate is what reactions make of `C(d)`, by its volume.

# %%
surface = ct.Interface("diamond.yaml", "diamond_100")
gas, bulk = surface.adjacent["gas"], surface.adjacent["diamond"]
gas.TP = 1200.0, 20 * ct.one_atm / 760
start = gas.mole_fraction_dict()

expected, hydrogen = [], []
fractions = gas.X
for _ in range(4):
    fractions[gas.species_index("H")] /= 2.3
    gas.TPX = 1200.0, 20 * ct.one_atm / 760, fractions
    hydrogen.append(gas["H"].X[0])
    surface.advance_coverages(10.0, rtol=1e-10, atol=1e-16)
    rate = surface.get_net_production_rates(bulk)[0]
    expected.append(rate * bulk.molecular_weights[0] / bulk.density * 1e6 * 3600)

found = []
for x_h in hydrogen:
    others = {name: value for name, value in start.items() if name not in ("H", "H2")}
    scale = (1 - x_h) / (1 - start["H"])  # the example scales what is left
    composition = {"H": x_h, **{name: value * scale for name, value in others.items()}}
    changes = {
        "interface.mechanism.neighbours.gas": {
            "pressure": "20 torr",
            "composition": composition,
            "rest": "H2",
        },
        "run": {"until": "10 s", "outputs": 2, "solver": "cantera", "rtol": 1e-9},
    }
    data = surfacechem.load("diamond-growth", changes).run(error="balances").dataset
    molecules = float(data["production_C_d"][-1])  # 1/(m^2 s)
    found.append(
        molecules
        / 6.02214076e26
        * bulk.molecular_weights[0]
        / bulk.density
        * 1e6
        * 3600
    )

plt.figure()
plt.plot(hydrogen, expected, "k-", lw=0.5)
plt.plot(hydrogen, found, "o")
plt.xlabel("mole fraction of H")
plt.ylabel("growth [µm/h]")
print(f"largest difference: {np.max(np.abs(np.array(found) / expected - 1)):.1e}")
np.testing.assert_allclose(found, expected, rtol=1e-6)

# %% [markdown]
# ## The anode of a lithium-ion cell: `lithium_ion_battery`
#
# The example finds the potential at which no current flows. The case `lithium-polarisation` sweeps the potential, so
# that is where its current changes sign; from the Gibbs energy of the reaction it follows by itself.

# %%
data = surfacechem.run("lithium-polarisation").dataset
potential, current = data["V_electron"].values, data["i_electron"].values

anode = ct.Interface("lithium_ion_battery.yaml", "edge_anode_electrolyte")
electrons, electrolyte = anode.adjacent["electron"], anode.adjacent["electrolyte"]
anode.adjacent["anode"].X = {"Li[anode]": 0.5, "V[anode]": 0.5}
electrolyte.X = {
    "C3H4O3[elyt]": 0.47901,
    "C4H6O3[elyt]": 0.37563,
    "Li+[elyt]": 0.07268,
    "PF6-[elyt]": 0.07268,
}
for phase in (anode, *anode.adjacent.values()):
    phase.TP = 300.0, ct.one_atm
open_circuit = -anode.delta_gibbs[0] / ct.faraday
expected = []
for volts in potential:
    electrons.electric_potential = volts
    expected.append(-anode.get_net_production_rates(electrons)[0] * ct.faraday)

plt.figure()
plt.plot(potential, expected, "k-", lw=0.5)
plt.plot(potential[::4], current[::4], "o")
plt.axvline(open_circuit, color="0.7")
plt.xlabel("potential [V]")
plt.ylabel("current into the electrode [A/m²]")
zero = np.interp(0.0, np.sign(current[-1] - current[0]) * current, potential)
print(f"no current at {zero:.4f} V, Gibbs energy of the reaction {open_circuit:.4f} V")
np.testing.assert_allclose(
    current, expected, rtol=1e-8, atol=1e-9 * np.abs(current).max()
)

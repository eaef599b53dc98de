"""Cantera surface mechanisms: one mixture potential, and one rate law per reaction.

``thermo`` (standard Gibbs energies), ``mixture`` (the free energy of the coverages), ``rates`` (one class per rate
type), ``keys`` (what a mechanism file may hold) and ``load`` (from file to laws).
"""

from surfacechem.mechanism.load import Mechanism, load_mechanism

__all__ = ["Mechanism", "load_mechanism"]

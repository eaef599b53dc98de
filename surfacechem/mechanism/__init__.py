"""Cantera surface mechanisms: one mixture potential, and one rate law per reaction.

``thermo`` (standard Gibbs energies, their dependence on coverages, and the free energy of the mixture), ``rates`` (one
class per rate type), ``evaluated`` (rates that Cantera evaluates), ``source`` and ``keys`` (the text of a mechanism
file and its valid keys) and ``load`` (from file to laws).
"""

from surfacechem.mechanism.load import Mechanism, load_mechanism

__all__ = ["Mechanism", "load_mechanism"]

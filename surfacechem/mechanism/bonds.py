"""Rate types of bonds under load: an Arrhenius coefficient times what the load does to it.

Each factor is the one that the law of a case uses; the classes here only give it its name in a mechanism.
"""

from __future__ import annotations

from collections.abc import Mapping

from surfacechem.contracts.terms import RateFactor, reads
from surfacechem.expressions import Expression
from surfacechem.laws.bonds import (
    BellFactor,
    DemboFactor,
    DemboFormationFactor,
    DudkoFactor,
    GapFactor,
    TwoPathwayFactor,
)
from surfacechem.mechanism.rates import InterfaceArrhenius


class LoadedReaction(InterfaceArrhenius, RateFactor):
    """A surface reaction whose rate coefficient depends on a load; subclasses add a factor."""

    formula = "rate"
    contract = "bonding"

    kind = ""
    native = False

    @classmethod
    def own_keys(cls) -> dict[str, str]:
        """Keys of the reaction in a mechanism file, each with the field that it gives."""
        return {name.replace("_", "-"): name for name, _ in factor_of(cls).specs()}

    @property
    def load(self) -> str:
        """The force per bond: that of the elastic bond which reacts or forms, else the one shared or prescribed."""
        elastic = {item.variable for item in self.species if item.spring}
        return next((f"f_{name}" for name in (*self.orders, *self.products) if name in elastic), "f")

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Those of the factor, for the force on the bond of this reaction."""
        return {self.load if name == "f" else name: limits for name, limits in super().ranges.items()}

    @property
    def peaks(self) -> Mapping[str, Expression]:
        """Those of the factor, for the force on the bond of this reaction."""
        return {self.load if name == "f" else name: top for name, top in super().peaks.items()}

    def own_reads(self) -> tuple[str, ...]:
        """Coverages, and the force or the gap."""
        arguments = (self.load if name == "f" else name for name in reads(self.log_factor) if name != "T_c")
        return (*super().own_reads(), *arguments)

    def exponent(self, values: Mapping[str, Expression]) -> Expression:
        """Exponent of the rate coefficient with that of the load."""
        arguments = {name: values[self.load if name == "f" else name] for name in reads(self.log_factor)}
        return super().exponent(values) + self.log_factor(**arguments)


class InterfaceBell(LoadedReaction, BellFactor):
    r"""Slip bond in a mechanism, ``type: Bell``.

    .. math:: k = A\,T^b \exp\left( -\frac{E_a}{R_g T} + \frac{f x_\beta}{k_B T} \right)

    ``x-beta`` is that of the forward direction; the reverse follows from the potential, which contains the elastic
    energy of bonds that have a stiffness. Source: Bell (1978), Science 200, 618, doi 10.1126/science.347575.
    """

    kind = "interface-Bell"

    @property
    def distance(self) -> Expression | None:
        """That to the transition state, under a force that is not the bond's own."""
        return self.x_beta if self.load == "f" else None


class InterfaceDembo(LoadedReaction, DemboFactor):
    r"""Rupture of a bond spring in a mechanism, ``type: Dembo``.

    .. math:: k = A\,T^b \exp\left( -\frac{E_a}{R_g T} + \frac{(\kappa - \kappa_{ts}) f^2}{2 \kappa^2 k_B T} \right)

    Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038.
    """

    kind = "interface-Dembo"


class InterfaceDemboFormation(LoadedReaction, DemboFormationFactor):
    r"""Formation of a bond spring in a mechanism, ``type: Dembo-formation``.

    .. math:: k = A\,T^b \exp\left( -\frac{E_a}{R_g T} - \frac{\kappa_{ts} f^2}{2 \kappa^2 k_B T} \right)

    Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038.
    """

    kind = "interface-Dembo-formation"


class InterfaceTwoPathway(LoadedReaction, TwoPathwayFactor):
    r"""Catch-slip bond in a mechanism, ``type: two-pathway``.

    .. math:: k = A\,T^b e^{-E_a / R_g T} \left( e^{f x_{slip} / k_B T} + r_c\,e^{-f x_{catch} / k_B T} \right)

    Pathways with activation energies of their own are two reactions of type Bell, one with a negative ``x-beta``.
    Source: Pereverzev, Prezhdo, Forero, Sokurenko & Thomas (2005), doi 10.1529/biophysj.105.062158.
    """

    kind = "interface-two-pathway"


class InterfaceDudkoHummerSzabo(LoadedReaction, DudkoFactor):
    r"""Slip bond over a barrier of given shape in a mechanism, ``type: Dudko-Hummer-Szabo``.

    .. math:: k = A\,T^b e^{-E_a / R_g T}\,s^{1/\nu - 1} e^{\Delta G (1 - s^{1/\nu}) / k_B T},
              \quad s = 1 - \frac{\nu f x_\beta}{\Delta G}

    Source: Dudko, Hummer & Szabo (2006), doi 10.1103/PhysRevLett.96.108101.
    """

    kind = "interface-Dudko-Hummer-Szabo"


class InterfaceGapAttachment(LoadedReaction, GapFactor):
    r"""Formation of bonds across a gap in a mechanism, ``type: gap-attachment``.

    .. math:: k = A\,T^b \exp\left( -\frac{E_a}{R_g T} - \frac{k_b (g_n - l_0)^2}{2 k_B T} \right)

    Source: Dembo, Torney, Saxman & Hammer (1988), doi 10.1098/rspb.1988.0038.
    """

    kind = "interface-gap-attachment"


def factor_of(law: type[LoadedReaction]) -> type[RateFactor]:
    """The factor that a rate type adds."""
    return next(base for base in law.__mro__ if issubclass(base, RateFactor) and not issubclass(base, LoadedReaction))

"""A mass on a driven spring whose contact sticks the better the more bonds it has."""

from __future__ import annotations

from surfacechem.contracts.terms import parameter
from surfacechem.errors import InputError
from surfacechem.references.base import Reference


class BondedSlider(Reference):
    """What the solutions share: the spring, and friction coefficients with and without bonds."""

    m: float = parameter("kg/m^2", "mass", above=0)
    k: float = parameter("Pa/m", "tangential stiffness", above=0)
    V: float = parameter("m/s", "speed of the spring's end", above=0)
    p: float = parameter("Pa", "contact pressure", above=0)
    mu_b: float = parameter("1", "static friction coefficient of complete bonding", above=0)
    mu_ub: float = parameter("1", "static friction coefficient without bonds", above=0)
    mu_k: float = parameter("1", "sliding friction coefficient", at_least=0)

    def __post_init__(self) -> None:
        """Refuse what sticks less than it slides, and limits so far apart that the contact slips back."""
        super().__post_init__()
        if not self.mu_k <= self.mu_ub <= self.mu_b <= 2.0 * self.mu_k + self.mu_ub:
            raise InputError(f"{self.name}: exact for mu_k <= mu_ub <= mu_b <= 2 mu_k + mu_ub only.")

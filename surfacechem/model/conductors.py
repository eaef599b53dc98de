"""Bodies that conduct heat, as the assembled scene knows them."""

from __future__ import annotations

from dataclasses import dataclass

from surfacechem.expressions import Expression


@dataclass(frozen=True)
class Profile:
    """Temperatures across a body, from the contact to the far side."""

    number: int
    body: str
    points: tuple[float, ...]
    """Places as fractions of the thickness."""
    thickness: str
    """Path of the thickness."""
    surface: str
    """Name of the temperature at the contact."""
    anchored: bool
    """Whether that is a state."""
    states: tuple[str, ...]
    """Names of the temperatures inside, in order."""
    far: str = ""
    """Name of the temperature at the far side where it is given."""

    @property
    def name(self) -> str:
        """Name in the dataset."""
        return f"profile_{self.number}"


@dataclass(frozen=True)
class Conductor:
    """A body that says how it conducts: what it takes to judge whether it may be one lump."""

    number: int
    body: str
    is_lump: bool
    resistance: Expression
    """L / k [m^2 K/W]."""
    capacity: Expression
    """Of the whole body [J/(m^2 K)]."""
    conductance: Expression | None
    """Of all paths at the contact [W/(m^2 K)]; None in perfect contact."""

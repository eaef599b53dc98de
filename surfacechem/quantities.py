r"""The table of quantities: symbol, unit, long name, equation tag.

Every name that a law may read or a dataset may contain is listed here once. Quantities are per unit reference area and
in SI units; temperatures are absolute. Sign conventions: the gap is :math:`g = x_2 - x_1`, the traction acts on body 1
(tension positive), :math:`q_k` flows from the interface into body k.

Source of tags: the equation labels of Sauer, Duong & Mandadapu (2021), doi 10.1177/10812865211032723.
"""

from __future__ import annotations

import re
from typing import NamedTuple

BOLTZMANN = 1.380649e-23
"""Boltzmann constant [J/K] (exact, SI 2019)."""

GAS_CONSTANT = 8.31446261815324
"""Molar gas constant [J/(mol K)] (exact, SI 2019)."""

AVOGADRO = 6.02214076e23
"""Avogadro constant [1/mol] (exact, SI 2019)."""

KILO = 1000.0
"""Moles in a kmol, Cantera's unit."""

MOLECULAR = KILO * AVOGADRO
"""Molecules in a kmol."""

STEFAN_BOLTZMANN = 5.670374419e-8
"""Stefan-Boltzmann constant [W/(m^2 K^4)] (SI 2019, rounded)."""


class Quantity(NamedTuple):
    """A named quantity: SI unit, long name, LaTeX symbol and the tag of its equation in the paper."""

    name: str
    unit: str
    long_name: str
    latex: str = ""
    tag: str = ""
    species: str = ""
    """Name of the species in the mechanism, for a coverage; else empty."""


def _table(*rows: tuple[str, ...]) -> dict[str, Quantity]:
    return {row[0]: Quantity(*row) for row in rows}


VARIABLES = _table(
    ("t", "s", "time", "t"),
    ("T_0", "K", "reference temperature", "T_0"),
    ("T_1", "K", "temperature of body 1", "T_1"),
    ("T_2", "K", "temperature of body 2", "T_2"),
    ("T_c", "K", "interface temperature", "T_c"),
    ("T_a", "K", "temperature of the surroundings", "T_a"),
    ("T_from", "K", "temperature of the first end of a heat path"),
    ("T_to", "K", "temperature of the second end of a heat path"),
    ("phi", "1", "bonding state: bonded sites per reference site", r"\phi", "e:phi_def"),
    ("ln_phi", "1", "logarithm of the bonding state", r"\ln\phi"),
    ("g_n", "m", "normal gap", "g_n"),
    ("g_t", "m", "elastic tangential gap", "g_t"),
    ("u_t", "m", "tangential displacement of body 2 relative to body 1", "u_t"),
    ("u_t2", "m", "displacement of body 2 relative to body 1 across u_t, along the interface", "u_{t2}"),
    ("v_n", "m/s", "opening velocity of the normal gap", r"\dot g_n"),
    ("v_t", "m/s", "tangential velocity of body 2 relative to body 1", r"\dot u_t"),
    ("v", "m/s", "sliding velocity of body 2 relative to body 1", "v"),
    ("drive", "1", "friction traction in units of its direct effect, a p", r"t_t / a p"),
    ("v_2", "m/s", "sliding velocity across v, along the interface", "v_2"),
    ("speed", "m/s", "speed of sliding: magnitude of the velocity (v, v_2)", r"|v|"),
    ("turn", "rad", "angle by which sliding has turned since it began", r"\alpha"),
    ("theta", "s", "age of the contact", r"\theta"),
    ("ln_theta", "1", "logarithm of the age of the contact in seconds", r"\ln\theta"),
    ("direction", "1", "direction of sliding: component along v of its unit vector", r"\mathrm{sgn}\,v"),
    ("direction_2", "1", "direction of sliding: component across v of its unit vector"),
    ("w_n", "m", "far-field normal separation", "w_n"),
    ("w_t", "m", "far-field tangential displacement", "w_t"),
    ("w_t2", "m", "far-field displacement across w_t, along the interface", "w_{t2}"),
    ("F_n", "Pa", "far-field normal traction, tension positive", "F_n"),
    ("F_t", "Pa", "far-field tangential traction", "F_t"),
    ("F_t2", "Pa", "far-field traction across F_t, along the interface", "F_{t2}"),
    ("sticking", "1", "one while the interface sticks, zero while it slides"),
    ("softening", "1", "one while bonds break along an envelope"),
    ("overshoot", "1/s", "rate at which bonds would pass their envelope"),
    ("bonded", "1", "one while the interface is bonded, zero after it has debonded", "b"),
    ("p", "Pa", "contact pressure", "p"),
    ("p_contact", "Pa", "pressure that the contact bears, without attraction", r"p_{rep}"),
    ("t_s", "Pa", "magnitude of the traction that resists sliding", "t_s"),
    ("t_n", "Pa", "normal traction on body 1, tension positive", "t_n", "e:cons_tc"),
    ("f", "N", "force per bond, tension positive", "f"),
    ("J_c", "1", "area stretch of the reference surface", "J_c"),
    ("d_m", "m", "thickness of the medium between the bodies", "d_m"),
    ("p_m", "Pa", "pressure of the medium"),
    ("k_m", "W/(m K)", "thermal conductivity of the medium"),
    ("eta_m", "Pa s", "viscosity of the medium", r"\eta_m"),
    ("rho_m", "kg/m^3", "density of the medium", r"\rho_m"),
    ("cp_m", "J/(kg K)", "heat capacity of the medium at constant pressure", "c_{p,m}"),
    ("gamma_m", "1", "ratio of the heat capacities of the medium", r"\gamma_m"),
    ("f_m", "J/m^3", "thermal free energy of the medium per volume"),
    ("Q_1", "W/m^2", "external heat supplied to body 1", "Q_1"),
    ("Q_2", "W/m^2", "external heat supplied to body 2", "Q_2"),
    ("Q_c", "W/m^2", "external heat supplied to the interface", "Q_c"),
    ("n_c", "1/m^2", "current density of reference bonding sites", "n_c"),
    ("n_1", "1/m^2", "current density of bonding sites of body 1", "n_1"),
    ("n_2", "1/m^2", "current density of bonding sites of body 2", "n_2"),
    ("mu", "J", "chemical potential change of the reaction per bond", r"\mu_c", "e:muc"),
    ("dmu_dphi", "J", "derivative of the chemical potential per bond with respect to the bonding state"),
)
"""Variables that laws may read. Temperatures of bodies and interface resolve to the node that carries them."""

GAPS = frozenset(("g_n", "g_t", "u_t", "u_t2"))
"""Distances between the bodies, which may be exactly zero."""

VELOCITIES = frozenset(("v_n", "v_t", "v", "v_2", "speed"))

INTERNAL = frozenset(("t", "T_from", "T_to", "ln_theta", "gamma_m", "f_m", "dmu_dphi"))
"""Variables that laws read from each other, and no case names."""

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def raised(text: str) -> str:
    """Return text with its powers as superscripts.

    >>> raised("J/(m^2 K)"), raised("m^-1")
    ('J/(m² K)', 'm⁻¹')
    """
    return re.sub(r"\^(-?\d+)", lambda m: m[1].translate(SUPERSCRIPTS), text)


GREEK = {
    *("alpha", "beta", "gamma", "delta", "epsilon", "eta", "theta", "kappa", "lambda", "mu", "nu", "xi"),
    *("pi", "rho", "sigma", "tau", "phi", "psi", "chi", "omega"),
}
"""Greek letters that names spell out."""


def spelled(name: str) -> str:
    r"""Return the LaTeX of a name with its subscript.

    >>> spelled("T_1"), spelled("phi"), spelled("D_coulomb"), spelled("theta_O_s")
    ('T_{1}', '\\phi', 'D_{\\mathrm{coulomb}}', '\\theta_{\\mathrm{O(s)}}')
    """
    head, _, subscript = name.partition("_")
    if not subscript:
        return _letters(head)
    if head == "theta":  # species of a surface
        subscript = re.sub(r"(?<=\w)_([sS])(?=_|$)", r"(\1)", subscript)
    parts = subscript.split("_")
    # Indices are single letters and numbers, set without an upright font.
    if all(len(part) == 1 or part in GREEK or re.fullmatch(r"\w?\d\w?", part) for part in parts):
        subscript = " ".join(part if re.search(r"\d", part) else _letters(part) for part in parts)
    elif set(parts) & GREEK:
        subscript = r"\,".join(map(_letters, parts))
    else:
        subscript = rf"\mathrm{{{'_'.join(parts)}}}".replace("_", r"\,")
    return f"{_letters(head)}_{{{subscript}}}"


def _letters(text: str) -> str:
    if text in GREEK:
        return f"\\{text}"
    return text if len(text) <= 1 else rf"\mathrm{{{text}}}"

"""Thresholds within which two numbers are equal, which every room shares, each with its derivation.

A number counts as zero below one of these times the size of what it is made of, a tolerance of the run (rtol, atol),
or what the clock resolves; the name of a rounding ends in EPS. Nothing else is imported here, so that compiled code may
freeze the values.

Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, 2nd ed., chapters 1 to 3.
"""

from sys import float_info

EPS = float_info.epsilon
"""Spacing of the doubles at 1, 2^-52 = 2.2e-16. One operation errs by at most half of it, time resolves no less."""

ULPS = 2 * EPS
"""Error of one term of a formula, 4.4e-16: library functions are right to one unit in the last place, not to half."""

FEW_EPS = 4 * EPS
"""Relative difference of numbers that are equal but for the order of a few operations, 8.9e-16: eight of them, at half
an EPS each. Also the closest bracket that Brent's method accepts.
"""

FORMULA_EPS = 16 * EPS
"""Rounding of a formula, 3.6e-15, relative to its largest term: some thirty operations in sequence, all of them in the
same direction.
"""

NEWTON_EPS = 64 * EPS
"""Residual that Newton's method cannot improve, 1.4e-14: FORMULA_EPS of both sides of an equation, and as much again
from the last correction.
"""

RUN_EPS = 4096 * EPS
"""Rounding of what is summed along a run, 9.1e-13: errors add like the root of their number (section 2.8), and a run
has at most some 1e7 of them.
"""

GUARD_EPS = 512 * EPS
"""Relative size below which guards are zero and times the same, 1.1e-13: NEWTON_EPS of the step onto an event, and
eight times that for what is added up between two looks at it.
"""

SQRT_EPS = EPS**0.5
"""Step of a one-sided difference, 1.5e-8, where truncation and rounding are equal; also how closely the place of a
smooth minimum is known, since its value changes with the square of the distance.
"""

CBRT_EPS = EPS ** (1 / 3)
"""Step of a central difference, 6.1e-6: its truncation is of second order."""

QUARTER_EPS = EPS**0.25
"""Step of a second difference, 1.2e-4, which divides the rounding by the square of the step."""

NEGLIGIBLE = 1e-3
"""Fraction of a whole that changes no decision: step sizes and iterations are known to a few per cent at best."""

TINY = float_info.min / EPS
"""Least size of a divisor, 1e-292: what is smaller by a factor EPS is still a normal number."""

LOOSE_RTOL = 1e-10
"""Fraction of a run, or of the largest value of a guard, that is too brief or too shallow to tell at loose tolerances:
ten times the tolerance of a run that asks for none.
"""

LINE_ERROR = 1e-3
"""Largest error of a line between two outputs, relative to the range of a quantity: a pixel of a large figure."""

FINER_BY = 8
"""The stepper follows the states so many times closer, as quantities that depend on them may bend more."""

RUN_ERROR = 100.0
"""Tolerances of a value, or roundings, below which a change may be an error of the run: smooth runs err by less."""

TIME_EPS = 1e-12
"""Fraction of the time that has passed that no run resolves, in which nothing that stops is followed any more: RUN_EPS
of what is summed along it, to the next power of ten.
"""

IDLE = 1e-9
"""Fraction of the time that has passed within which nothing of interest happens: a thousand times TIME_EPS, which a
clock tells apart, and far below what any output does.
"""

BRIEF_PART = 1e-6
"""Fraction of a run that counts as brief: a thousand times IDLE, so that steps may still follow what happens in
it.
"""

NO_AMOUNT = 1e-9
"""Amount of a variable, in its SI unit, that means nothing: a billionth of an area or of a fraction, a nanopascal, a
nanokelvin. No run is asked for more digits than nine, which leaves that of a variable of order one.
"""

BOUND_SLACK = 1e-6
"""Largest excess of a bonding variable over its bounds while no run has said how accurate it is: the coarsest relative
tolerance in use.
"""

LEAST_BONDED = 1e-12
"""Bonded fraction that is no bond any more: of 1e16 sites on a square metre, one bond on a square centimetre."""

FRACTION_FLOOR = 1e-300
"""Fractions below this count as this in a logarithm, as Cantera does for vanished species; a product of it with any
rate above 1e-8 is a normal number.
"""

LEAST_COVERAGE = 1e-280
"""A vanished coverage counts as this where its logarithm has to cancel: next to it FRACTION_FLOOR is less than a
rounding, by four decades.
"""

LARGEST_COVERAGE = 1 - 1e-15
"""A full coverage counts as this, for the logarithm of what is left: four EPS from one."""

MICROMETRE = 1e-6
"""Scale of gaps [m] and of their velocities [m/s]: with EPS they are rounded at 2e-22 m, far below any atom."""

PICOMETRE = 1e-12
"""Length [m] without a meaning for bodies: a hundredth of an atom."""

NANOMETRE = 1e-9
"""Gap [m] below which the size of a gap counts as this one: surfaces are no smoother."""

GAP_EPS = NEWTON_EPS * MICROMETRE
"""Gap [m] that counts as none, 1.4e-20: what a search leaves of a micrometre, far below any atom."""

ATOL_OF_SCALE = 1e-6
"""Default absolute tolerance of a state: this fraction of its scale, times rtol. Scales are those of the largest values
in use, and states matter over some six decades below them.
"""

DEFAULT_RTOL = 1e-11
"""Relative tolerance of a run: errors of smooth ones stay below 1e-10, and energy closes to 1e-10 of what is exchanged.
"""

CLOSED_GUARD = 1e-30
"""Fraction of its largest value at which a margin that has shrunk is closed at any speed: the square of SQRT_EPS *
LOOSE_RTOL, below what any rounding or tolerance leaves of it.
"""

MIN_RTOL = 1e-13
"""Tightest relative tolerance that is chosen for a run: below some 450 EPS errors of steps are their rounding."""

SUM_RTOL = 1e-10
"""Accuracy of integrals over surfaces, relative: one digit more than runs are usually held to."""

CONTROL_RTOL = 3e-14
"""Tolerance of the run that is held against one at MIN_RTOL, near enough to it to have the same digits."""

LOOSEST_RTOL = 1e-3
"""Loosest tolerance that is chosen for a run: NEGLIGIBLE. With more a method does not have its order."""

MAX_RTOL = 0.1
"""Loosest tolerance that may be asked for: with more a run has no digit."""

ERROR_FLOOR = 1e-9
"""Fraction of the whole that replaces a smaller value where its error is made relative: of the run for times of events,
of their largest for exact answers. The same as NO_AMOUNT.
"""

CONSERVED_RATE = 1e-10
"""Rates slower than this part of the fastest are zero, of a conserved quantity: eigenvalues err by EPS times the
condition of their vectors, 1e5 at most in scaled rows.
"""

EQUAL = 1e-9
"""Relative difference up to which numbers of a scene and of an exact solution are equal: cases are written with nine
digits and converted.
"""

EQUATION_MISMATCH = 1e-6
"""Relative residual of an equation with which an exact solution still satisfies it: differences in time keep seven
digits near events, where they are worst. Scenes that differ in more than their sixth digit are told apart.
"""

TRACTION_EPS = 1e-14
"""Fraction of the tractions that cancel in a balance of sliding that counts as none: NEWTON_EPS, rounded down."""

BOUND_EPS = 1e-15
"""Distance from a bound, in parts of the range, at which a law that has no rate at the bound itself is asked: about
FEW_EPS, the nearest that a fraction is told from one. An equilibrium that lies nearer is one at the bound.
"""

LEAST_CREEP = 1e-25
"""Least velocity [m/s] that counts where friction has a state: it creeps at rest, tens of decades below sliding."""

ZERO_TIME = 1e-100
"""Time [s] that counts as zero: a rate at the cap of an exponent, 1e130 times its prefactor, is over within it."""

DRIFT = 100.0
"""Unbalanced traction that the integration explains, relative to its parts and in units of the tolerance."""

MOST_DRIFT = 0.1
"""Largest such traction relative to its parts, at any tolerance: of what cancels to less the sign is known."""

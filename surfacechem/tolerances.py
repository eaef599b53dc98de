"""Thresholds of all rooms below which two numbers count as equal, each with its derivation.

A number counts as zero below one of these times the size of its terms, below a tolerance of the run (rtol, atol), or
below the resolution of time; names of roundoff end in EPS. Nothing else is imported here, so that compiled code may
freeze the values.

Source: Higham (2002), Accuracy and Stability of Numerical Algorithms, 2nd ed., chapters 1 to 3.
"""

from sys import float_info

EPS = float_info.epsilon
"""Spacing of doubles at 1, 2^-52 = 2.2e-16. One operation errs by at most half of it; time resolves no less."""

ULPS = 2 * EPS
"""Error of one term of a formula, 4.4e-16: library functions are accurate to one unit in the last place, not half."""

FEW_EPS = 4 * EPS
"""Relative difference of numbers that are equal except for the order of a few operations, 8.9e-16: eight of them, at
half an EPS each. Also the narrowest bracket that Brent's method accepts.
"""

FORMULA_EPS = 16 * EPS
"""Roundoff of a formula, 3.6e-15, relative to its largest term: some thirty operations in sequence, with errors of the
same sign.
"""

NEWTON_EPS = 64 * EPS
"""Residual that Newton's method cannot reduce, 1.4e-14: FORMULA_EPS of both sides of an equation, and as much again
from the last correction.
"""

RUN_EPS = 4096 * EPS
"""Roundoff of a sum along a run, 9.1e-13: errors add like the square root of their number (section 2.8), and a run has
at most some 1e7 of them.
"""

GUARD_EPS = 512 * EPS
"""Relative size below which guards count as zero and times as equal, 1.1e-13: NEWTON_EPS of the step onto an event, and
eight times that for sums between two evaluations of a guard.
"""

SQRT_EPS = EPS**0.5
"""Step of a one-sided difference, 1.5e-8, at which truncation and roundoff are equal; also the accuracy of the place of
a smooth minimum, since its value changes with the square of the distance.
"""

CBRT_EPS = EPS ** (1 / 3)
"""Step of a central difference, 6.1e-6: its truncation error is of second order."""

QUARTER_EPS = EPS**0.25
"""Step of a second difference, 1.2e-4, which divides the roundoff by the square of the step."""

LEAST_WEIGHT = float_info.min
"""Least tolerance of a state, 2e-308: its inverse times any smaller error is finite."""

UNEQUAL = 1.0, -2.0, 3.0, -1.0, 2.0, -3.0
"""Changes of states in turn, in units of their tolerances, a choice: those of two do not cancel in a difference."""

NEGLIGIBLE = 1e-3
"""Fraction that changes no decision: step sizes and iterations are known to a few per cent at best."""

TINY = float_info.min / EPS
"""Least size of a divisor, 1e-292: a number smaller by a factor EPS is still normal."""

LOOSE_RTOL = 1e-10
"""Fraction of a run, or of the largest value of a guard, that counts as too brief or too shallow to resolve at loose
tolerances: ten times the default tolerance of a run.
"""

LINE_ERROR = 1e-3
"""Largest error of linear interpolation between outputs, relative to a quantity's range: a pixel of a large figure."""

FINER_BY = 8
"""Factor by which the stepper stores states more closely, as quantities that depend on them may be more curved."""

RUN_ERROR = 100.0
"""Tolerances of a value, or its roundoff, below which a change may be an error of the run: smooth runs err by less."""

TIME_EPS = 1e-12
"""Fraction of the elapsed time that no run resolves, and within which a motion that stops is no longer followed:
RUN_EPS of sums along it, rounded up to a power of ten.
"""

IDLE = 1e-9
"""Fraction of the elapsed time within which nothing relevant happens: a thousand times TIME_EPS, so that times can be
told apart, and far below the spacing of outputs.
"""

BRIEF_PART = 1e-6
"""Fraction of a run that counts as brief: a thousand times IDLE, so that steps may still resolve it."""

NO_AMOUNT = 1e-9
"""Negligible amount of a variable, in its SI unit: a billionth of an area or of a fraction, a nanopascal, a nanokelvin.
No more than nine digits are requested of a run, and this is the ninth of a variable of order one.
"""

BOUND_SLACK = 1e-6
"""Largest excess of a bonding variable over its bounds while the accuracy of the run is unknown: the coarsest relative
tolerance in use.
"""

LEAST_BONDED = 1e-12
"""Bonded fraction that counts as no bond: of 1e16 sites on a square metre, one bond on a square centimetre."""

FRACTION_FLOOR = 1e-300
"""Least fraction in a logarithm; smaller ones count as this, as in Cantera for vanished species. Its product with any
rate above 1e-8 is a normal number.
"""

LEAST_COVERAGE = 1e-280
"""Value of a vanished coverage where its logarithm has to cancel: compared with it FRACTION_FLOOR is below roundoff by
four decades.
"""

REPULSION_WALL = 0.01
"""Gap over g_0 below which a Lennard-Jones repulsion, then 1e16 times the adhesion energy, continues as a parabola."""

LARGEST_COVERAGE = 1 - 1e-15
"""Value of a full coverage, for the logarithm of the rest: four EPS from one."""

MICROMETRE = 1e-6
"""Scale of gaps [m] and of their velocities [m/s]: with EPS their roundoff is 2e-22 m, far below any atom."""

PICOMETRE = 1e-12
"""Length [m] without a meaning for bodies: a hundredth of an atom."""

NANOMETRE = 1e-9
"""Least size assigned to a gap [m]: surfaces are no smoother."""

GAP_EPS = NEWTON_EPS * MICROMETRE
"""Gap [m] that counts as zero, 1.4e-20: the error of a search at a micrometre, far below any atom."""

ATOL_OF_SCALE = 1e-6
"""Default absolute tolerance of a state: this fraction of its scale, times rtol. Scales are the largest values in use,
and states matter over some six decades below them.
"""

DEFAULT_RTOL = 1e-11
"""Relative tolerance of a run: errors of smooth runs stay below 1e-10, and the energy balance closes to 1e-10 of the
amounts exchanged.
"""

CLOSED_GUARD = 1e-30
"""Fraction of its largest value at which a shrunken margin counts as closed at any speed: the square of SQRT_EPS *
LOOSE_RTOL, below any roundoff or tolerance of it.
"""

MIN_RTOL = 1e-13
"""Tightest relative tolerance that is chosen for a run: below some 450 EPS the errors of steps are roundoff."""

SUM_RTOL = 1e-10
"""Relative accuracy of integrals over surfaces: one digit more than usually required of runs."""

CONTROL_RTOL = 3e-14
"""Tolerance of the run that is compared with one at MIN_RTOL, close enough to it to have the same digits."""

LINEAR_RTOL = 1e-6
"""Tightest tolerance of linearly implicit steps in lanes. Each digit takes 1.6 (the fifth root of ten) times as many of
them, but only 1.2 times as many of Radau IIA, of which one takes four times as long. Both take as long here on a smooth
stiff run; where Newton's method shortens steps of Radau IIA, as in a rupture, these take a quarter of the time.
"""

LOOSEST_RTOL = 1e-3
"""Loosest tolerance that is chosen for a run: NEGLIGIBLE. At looser ones a method does not reach its order."""

MAX_RTOL = 0.1
"""Loosest tolerance that may be requested: beyond it a run has no correct digit."""

ERROR_FLOOR = 1e-9
"""Fraction of the whole that replaces smaller values in relative errors: of the run for times of events, of the largest
value for exact solutions. The same as NO_AMOUNT.
"""

CONSERVED_RATE = 1e-10
"""Part of the fastest rate below which a rate counts as zero, that of a conserved quantity: eigenvalues err by EPS
times the condition number of their vectors, at most 1e5 in scaled rows.
"""

EQUAL = 1e-9
"""Relative difference up to which numbers of a scene and of an exact solution count as equal: cases are written with
nine digits and converted.
"""

EQUATION_MISMATCH = 1e-6
"""Relative residual up to which an exact solution satisfies an equation: difference quotients in time keep seven digits
near events, where they are worst. Scenes that differ in the sixth digit are distinguished.
"""

TRACTION_EPS = 1e-14
"""Fraction of the cancelling tractions in a sliding balance that counts as zero: NEWTON_EPS, rounded down."""

BOUND_EPS = 1e-15
"""Distance from a bound, in parts of the range, at which a law without a rate at the bound is evaluated: about FEW_EPS,
the nearest that a fraction can be told from one. A closer equilibrium is at the bound.
"""

RELATIVE_INERTIA = 1e-14
"""Part of the reference velocity of creeping friction below which its drive has a constant inertia: that of velocities
a thousand times slower is right to DEFAULT_RTOL, that of the reference to NEWTON_EPS, rounded down.
"""

LEAST_CREEP = 1e-19
"""Fraction of the reference velocity of friction with a state that counts: the creep at rest, exp(-mu / a) of it at a
coefficient mu of 0.6 and a direct effect a of 0.014.
"""

ZERO_TIME = 1e-100
"""Time [s] that counts as zero: a rate at the cap of an exponent, 1e130 times its prefactor, acts within it."""

DRIFT = 100.0
"""Residual of tractions that the integration may cause, relative to their terms and in units of the tolerance."""

MOST_DRIFT = 0.1
"""Largest such residual relative to the terms, at any tolerance: a larger one has a known sign."""

SINGULAR_NOISE = NEGLIGIBLE**2
"""Noise above this part of a variable and of its typical size would mean a singular matrix, not roundoff."""

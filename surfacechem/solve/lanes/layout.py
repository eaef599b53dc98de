"""Memory layout of a block of lanes: names, types and shapes of the arrays behind the record of the compiled loop.

It imports nothing of Numba.
"""

from surfacechem.compile.vectors import LANES

SIZES = ("n", "n_ledger", "n_margins", "n_inputs", "columns")
"""Sizes of a program, in the order of its table; columns are what is integrated, states and ledger accounts."""
ORDER = 7
"""Order of the dense output of a step, and number of coefficients of its polynomial."""

NUMBERS = {"loose": float, "free": int, "ended": int}
"""Scalars that change: loosening of the estimates, lanes without a run, runs that end in a step."""


def _arrays(names: str, *shape: str | int, kind: type = float) -> dict[str, tuple[type, tuple[str | int, ...]]]:
    return dict.fromkeys(names.split(), (kind, (*shape, LANES)))


MEMORY = {
    # t, y, ydot, parameters, and what is formed from them: the argument of every function of the program; the
    # same of each lane by itself, at eight points of its step
    **_arrays("inputs", "n_inputs"),
    **_arrays("inside", LANES, "n_inputs"),
    # states and accounts at the start and at the end of the step, their changes per time at its last two stages, the
    # two estimates of their error, their rates at a point inside and how far they may be from the slopes there
    **_arrays("y y_new change change_before coarse fine rates allowed", "columns"),
    # the coefficients of the polynomial of the step and of its slope
    **_arrays("polynomial slope_of", ORDER, "columns"),
    # weights of the error norm; of each account the largest value, and in this step the largest rate and what its error
    # is held against
    **_arrays("weight", "n"),
    **_arrays("q_largest q_rate q_scale", "n_ledger"),
    # guards: value now and at the two points before, at the start, at the quarters and at the end of the step;
    # largest value so far; side of zero, 0 where it is not known yet; whether each is met in the step
    **_arrays("margin margin_before margin_earlier margin_first", "n_margins"),
    **_arrays("margin_quarters", 3, "n_margins"),
    **_arrays("margin_end margin_largest side fired", "n_margins"),
    # the time, now and at the end of the step; start and end of the segment, a time at which a step has to end, and
    # that of the next output
    **_arrays("t t_new entered end aim next_output"),
    # this step, the last one and one that failed, the norms of their errors, roots of the first two of these,
    # the next step; how far apart looks at the equations are
    **_arrays("h h_last h_tried norm norm_tried root root_last proposed following spacing_of"),
    # whole spacings of looks in the step, -1 if it has no looks, and where these are; the fraction of the step at
    # which it has missed something, and at which it meets a guard, with the bracket of that
    **_arrays("spacings at defect_at crossing low high"),
    # a step onto a guard: its value at the end, its slope, the longest step to try, the last push across
    **_arrays("value slope longest nudge"),
    # evaluations of the equations
    **_arrays("evaluations"),
    # flags: whether the derivatives of the rates at the start of the step are known, and those at its end
    **_arrays("known known_at_end"),
    # flags: a start or restart; the first step of a segment, the last one; a step onto a guard; one that is repeated;
    # one that is stiff; guards of which it is unclear whether they are met; a step that is taken; parameters that are
    # inside, too
    **_arrays("fresh begins last onto again stiff unclear taken spread"),
    # whether a lane has a run, and whether something is to be done for it alone; its steps, rejected ones, those in a
    # row, most of both; twice the stiff ones; trials of a step onto a guard
    **_arrays("busy pending steps rejected failed most_steps stiff_steps landing"),
    # the run of each lane, -1 where there is none, and the run that has just ended there; its segment
    **_arrays("run over segment", kind=int),
}
"""Arrays that the loop writes to, whatever the method: type and shape, with a place for each lane."""

EXPLICIT_MEMORY = {
    **MEMORY,
    # rates at the stages
    **_arrays("k", 16, "columns"),
}
"""Arrays of the loop with explicit steps."""

_END_SLOPES = {**_arrays("end_jacobian", "n", "n"), **_arrays("end_time_slopes", "n")}
"""Derivatives of the rates at the end of a step, as those at its start."""

RADAU_MEMORY = {
    **MEMORY,
    # rates at the start and at the stages, and the correction of the polynomial; of the last step at its stages
    **_arrays("k", 7, "columns"),
    **_arrays("k_last", 5, "n"),
    # increments of the stages, their residuals and corrections, right-hand sides of the decoupled systems with an
    # imaginary part of the real one; coefficients of the predictor
    **_arrays("z g parts predictor", 5, "n"),
    **_arrays("imaginary error rhs", "n"),
    # derivatives of the rates at the start; those by time, which the code writes too; Newton matrices (system, real and
    # imaginary part), overwritten by their factors, with flags of the rows that are exchanged
    **_arrays("jacobian", "n", "n"),
    **_arrays("time_slopes", "n"),
    **_END_SLOPES,
    **_arrays("matrix", 3, 2, "n", "n"),
    **_arrays("exchanged", 3, "n", "n"),
    # Newton's method: contraction, now and of the last step; error of the first guess
    **_arrays("theta contraction guess_error"),
}
"""Arrays of the loop with steps of Radau IIA."""

ROSENBROCK_MEMORY = {
    # rates at the start, increments of the stages, rates and states at the end, as the code of the step has them; it
    # continues with the derivatives at the start, what the rates at the end are open by and a flag of doubtful
    # factors, and reads the weights
    **_arrays("k", 11, "columns"),
    **_arrays("jacobian", "n", "n"),
    **_arrays("time_slopes gap", "n"),
    **_arrays("doubtful"),
    **_arrays("weight", "n"),
    **MEMORY,
    # the real matrix for checks against the equations, with flags of the rows that are exchanged, and right-hand sides
    **_END_SLOPES,
    **_arrays("matrix", 1, 2, "n", "n"),
    **_arrays("exchanged", 1, "n", "n"),
    **_arrays("imaginary rhs", "n"),
}
"""Arrays of the loop with linearly implicit steps."""

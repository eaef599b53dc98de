"""Error against run time: a case over tolerances and solvers, against a reference whose own uncertainty is stated.

``subject`` is what is solved, ``truth`` what it is held against, ``measure`` how errors and times are taken, ``study``
and ``columns`` the labelled result, ``figure`` and ``page`` what a reader sees.
"""

"""Studies of many runs: precision, stability, rates of a mechanism, reports."""

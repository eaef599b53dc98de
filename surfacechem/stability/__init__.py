"""What the solvers make of the dangerous regimes: solved to so many digits, refused for the right reason, or failed."""

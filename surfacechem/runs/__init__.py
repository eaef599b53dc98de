"""A case that runs, once or over a grid of parameters, and what is told about it before and after."""

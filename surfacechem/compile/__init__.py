"""Expressions as machine code and as readable Python, and the folder in which compiled code is kept."""

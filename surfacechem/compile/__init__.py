"""Expressions as machine code and as readable Python, and the cache folder of compiled code."""

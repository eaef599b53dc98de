"""Runs of a case, once or over a grid of parameters, and summaries before and after them."""

"""Substances between the bodies whose properties other packages know."""

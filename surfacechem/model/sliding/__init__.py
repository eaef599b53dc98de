"""Tangential motion: springs, masses and friction that sticks and slides, in one direction or two."""

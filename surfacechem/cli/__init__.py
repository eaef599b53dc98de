"""The command line."""

from surfacechem.cli.main import app

__all__ = ["app"]

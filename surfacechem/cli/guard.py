"""The trial of an output before anything is computed."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path


class _TriedError(Exception):
    """Ends an attempt to write."""


def refuse_unwritable(target: Path) -> None:
    """InputError where a file could not be written, so that nothing is computed in vain; leaves no trace."""
    from surfacechem.results.netcdf import replacing

    with suppress(_TriedError), replacing(target):
        raise _TriedError

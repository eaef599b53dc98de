"""The command line."""

import atexit
import os
import sys
from contextlib import suppress
from typing import Any

from surfacechem.cli.main import app

__all__ = ["app", "console"]


def console() -> None:
    """Run the command line and end the process at once: to free its objects one by one takes a tenth of a command."""
    try:
        app(prog_name="surfacechem")
    except SystemExit as end:
        end_functions: Any = atexit
        end_functions._run_exitfuncs()
        with suppress(OSError):  # Python's own end tells of what cannot be written
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(end.code if isinstance(end.code, int) else end.code is not None)
        raise

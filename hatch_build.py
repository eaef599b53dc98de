"""With SURFACECHEM_COMPILE=1 a wheel carries the compiled stepper, and is one for this platform and Python."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CompiledStepper(BuildHookInterface):  # type: ignore[type-arg]
    """Compiles the stepper while the wheel is built."""

    made: Path | None = None
    """Where it is until it is in the wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the compiled stepper to what the wheel holds."""
        if version == "editable" or os.environ.get("SURFACECHEM_COMPILE") != "1":
            return
        self.made = Path(mkdtemp())
        folder = self.made / "shipped"
        environment = {**os.environ, "PYTHONPATH": self.root}
        subprocess.run([sys.executable, "-m", "surfacechem.solve", str(folder)], env=environment, check=True)
        build_data["force_include"][str(folder)] = "surfacechem/compile/shipped"
        build_data |= {"pure_python": False, "infer_tag": True}

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what the wheel holds now."""
        if self.made is not None:
            shutil.rmtree(self.made)

"""The cache of the compiled stepper: found, absent, damaged, shared. The kernels here are tiny; the mechanism is the
same."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.around

KERNEL = """
import numpy as np


def kernel(x):
    x[0] = 42.0
"""
USE = """
import sys, warnings
from pathlib import Path
sys.path.insert(0, {here!r})
from tiny_kernel import kernel
from numba import float64, void
import numpy as np
from surfacechem.kernelcache import compile_kernel, is_filled, kernel_folder
folder = kernel_folder([Path({here!r}) / "tiny_kernel.py"])
x = np.zeros(1)
compiled = compile_kernel(kernel, void(float64[::1]), folder)
compiled(x)
assert x[0] == 42.0
print("hits", sum(compiled.stats.cache_hits.values()), "filled", is_filled(folder))
"""


@pytest.fixture
def start(tmp_path: Path):
    (tmp_path / "tiny_kernel.py").write_text(KERNEL)

    def run(cache: Path, first: str = "") -> subprocess.Popen[str]:
        environment = {**os.environ, "SURFACECHEM_CACHE": str(cache)}
        code = first + USE.format(here=str(tmp_path))
        return subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    return run


def finish(process: subprocess.Popen[str]) -> tuple[str, str]:
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    return out.strip(), err


def test_second_process_loads(start, tmp_path: Path) -> None:
    assert finish(start(tmp_path / "cache"))[0] == "hits 0 filled True"
    assert finish(start(tmp_path / "cache"))[0] == "hits 1 filled True"


def test_two_processes_at_once(start, tmp_path: Path) -> None:
    both = [start(tmp_path / "cache") for _ in range(2)]
    assert all(finish(process)[0].endswith("filled True") for process in both)
    assert finish(start(tmp_path / "cache"))[0] == "hits 1 filled True"


def test_folder_that_cannot_be_written(start, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    out, err = finish(start(tmp_path / "file" / "cache"))
    assert out == "hits 0 filled False"
    assert err.count("cannot be kept") == 1


def test_disk_that_is_full(start, tmp_path: Path) -> None:
    """No file may grow beyond nothing: every write fails as on a full disk."""
    out, err = finish(start(tmp_path / "cache", "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"))
    assert out.startswith("hits 0")
    assert err.count("cannot be kept") == 1
    assert finish(start(tmp_path / "cache"))[0] == "hits 0 filled True"


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_files_are_replaced(start, tmp_path: Path, suffix: str) -> None:
    finish(start(tmp_path / "cache"))
    for file in (tmp_path / "cache").glob(f"**/*.{suffix}"):
        file.write_bytes(b"damaged")
    assert finish(start(tmp_path / "cache"))[0] == "hits 0 filled True"
    assert finish(start(tmp_path / "cache"))[0] == "hits 1 filled True"


def test_importing_solvers_is_light() -> None:
    code = "import surfacechem.solvers.radau, sys; assert not {'numba', 'scipy', 'sksundae'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)

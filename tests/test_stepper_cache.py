"""The cache of the compiled stepper: found, absent, damaged, shared. The kernels here are tiny; the mechanism is the
same."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from random import Random
from types import SimpleNamespace

import pytest

from surfacechem import kernelcache, objectcode
from surfacechem.kernelcache import is_filled, unsealed
from surfacechem.solvers import stepper

pytestmark = pytest.mark.around

KERNEL = """
import numpy as np


def kernel(x):
    x[0] = 42.0
"""
COMMAND = """
import sys
from surfacechem.cli import app
app(["run", "exothermic", "-q", "-o", sys.argv[1]], standalone_mode=False)
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


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder of the stepper of this machine: its own code and Numba's."""
    stepper.compile_stepper()
    folder = tmp_path_factory.mktemp("cache") / stepper._folder().name
    shutil.copytree(stepper._folder(), folder)
    return folder


def test_a_flipped_bit_is_never_loaded(kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    random = Random(1)
    for file in (objectcode.FILE, *(str(path.relative_to(kept)) for path in kept.glob("*/*"))):
        content = (kept / file).read_bytes()
        for bit in (0, 8 * len(content) - 1, *(random.randrange(8 * len(content)) for _ in range(20))):
            folder = tmp_path / kept.name
            shutil.copytree(kept, folder)
            damaged = bytearray(content)
            damaged[bit // 8] ^= 1 << bit % 8
            (folder / file).write_bytes(damaged)
            if file == objectcode.FILE:
                assert objectcode.load(folder) is None
                assert not folder.exists()  # so that the next process makes it anew
            else:
                assert not is_filled(folder)
                shutil.rmtree(folder)


@pytest.mark.parametrize("content", [b"", b"damaged", b"kernel\ncode"])
def test_what_is_no_code_is_not_loaded(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "folder").mkdir(mode=0o755)
    (tmp_path / "folder" / objectcode.FILE).write_bytes(content)
    assert objectcode.load(tmp_path / "folder") is None


def test_a_command_runs_where_the_cache_is_damaged(kept: Path, tmp_path: Path) -> None:
    """Code that is cut off is not called but made anew; the run is that of every other day."""
    folder = tmp_path / "cache" / kept.name
    shutil.copytree(kept, folder)
    with (folder / objectcode.FILE).open("r+b") as file:
        file.truncate(1000)
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, str(tmp_path / "run.nc")],
        env={**os.environ, "SURFACECHEM_CACHE": str(folder.parent), "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert is_sound_object(folder / objectcode.FILE)


def is_sound_object(path: Path) -> bool:
    return unsealed(path.read_bytes()) is not None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="permissions of POSIX")
@pytest.mark.parametrize("which", ["root", "folder", "file", "link"])
def test_a_cache_that_another_user_can_write_to_is_refused(start, tmp_path: Path, which: str) -> None:
    cache = tmp_path / "cache"
    assert finish(start(cache))[0] == "hits 0 filled True"
    (folder,) = cache.iterdir()
    if which == "link":
        folder.rename(tmp_path / "elsewhere")
        folder.symlink_to(tmp_path / "elsewhere")
    else:
        path = {"root": cache, "folder": folder, "file": next(folder.glob("*/*.nbc"))}[which]
        path.chmod(path.stat().st_mode | 0o020)
    out, err = finish(start(cache))
    assert out == "hits 0 filled False"
    assert err.count("can be written by other users") == 1


def test_what_is_kept_is_writable_to_oneself_alone(start, tmp_path: Path) -> None:
    assert finish(start(tmp_path / "cache", "import os; os.umask(0o002)"))[0] == "hits 0 filled True"
    assert finish(start(tmp_path / "cache"))[0] == "hits 1 filled True"


def test_a_folder_that_another_process_removes_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kernel" / "part").mkdir(parents=True)
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    scandir = os.scandir

    def gone(path):
        if Path(path).name == "part":
            raise FileNotFoundError(path)
        return scandir(path)

    monkeypatch.setattr(os, "scandir", gone)
    assert kernelcache.untrusted(tmp_path / "kernel") is None


def test_what_is_compiled_but_cannot_be_sealed_is_not_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def compiled(*_):
        made.append(SimpleNamespace(stats=SimpleNamespace(cache_hits={}, cache_path=str(tmp_path / "gone"))))
        return made[-1]

    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    monkeypatch.setattr(kernelcache, "_compile", compiled)
    with pytest.warns(UserWarning, match="cannot be kept"):
        assert kernelcache.compile_kernel(lambda: None, None, tmp_path / "kernel") is made[0]
    assert len(made) == 1


def test_importing_solvers_is_light() -> None:
    code = "import surfacechem.solvers.radau, sys; assert not {'numba', 'scipy', 'sksundae'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)

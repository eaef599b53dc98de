"""The cache of the compiled stepper: found, absent, damaged, shared. The kernels here are tiny; the mechanism is the
same."""

import os
import platform
import shutil
import subprocess
import sys
from itertools import count
from pathlib import Path
from random import Random

import pytest

from surfacechem.compile import cache as kernelcache
from surfacechem.compile.cache import CODE_FILE, stored_code
from surfacechem.solve.radau import stepper

pytestmark = pytest.mark.around

KERNEL = """
def kernel(count, table):
    pass
"""
COMMAND = """
import sys
from surfacechem.cli import app
app(["run", "exothermic", "-q", "-o", sys.argv[1]], standalone_mode=False)
"""
USE = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
from surfacechem.compile.cache import stored_code
from surfacechem.solve.radau.stepper import Loop
loop = Loop("tiny", [Path({here!r}) / "tiny_kernel.py"], "tiny_kernel.kernel", (), {{}})
found = loop.is_compiled
loop.load()(1, [])
print("found", found, "kept", stored_code(loop.folder) is not None)
"""
STEPS = ["tempfile.mkstemp", "os.replace"]
BY_STEPS = f"""
import os, tempfile
from surfacechem.solve.radau import stepper
def pausing(usual):
    def step(*arguments, **options):
        print("paused", flush=True)
        input()
        return usual(*arguments, **options)
    return step
def compile(*arguments):
    code = usual(*arguments)
    for step in {STEPS}:
        exec(f"{{step}} = pausing({{step}})")
    return code
usual = stepper.compile_kernel
stepper.compile_kernel = pausing(compile)
"""
"""A process that has found nothing waits before it compiles, then before each step of keeping what it has compiled."""
MADE, FOUND, NOT_KEPT = "found False kept True", "found True kept True", "found False kept False"


@pytest.fixture
def start(tmp_path: Path):
    (tmp_path / "tiny_kernel.py").write_text(KERNEL)

    def run(first: str = "", cache: Path = tmp_path / "cache", here: Path = tmp_path) -> subprocess.Popen[str]:
        pipe, environment = subprocess.PIPE, {**os.environ, "SURFACECHEM_CACHE": str(cache)}
        command = [sys.executable, "-c", first + USE.format(here=str(here))]
        return subprocess.Popen(command, env=environment, stdin=pipe, stdout=pipe, stderr=pipe, text=True)

    return run


def pauses(process: subprocess.Popen[str]):
    """Count the steps of a process, which goes on with the next as the loop does."""
    for step in count():
        if process.stdout.readline() != "paused\n":
            return
        yield step
        process.stdin.write("go on\n")
        process.stdin.flush()


def finish(process: subprocess.Popen[str], warning: str = "") -> str:
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    assert err.count(warning or "compiled stepper") == bool(warning)
    return out.strip()


@pytest.mark.slow
def test_two_processes_at_once(start) -> None:
    both = [start(), start()]
    assert all(finish(process) == MADE for process in both)
    assert finish(start()) == FOUND


@pytest.mark.slow
def test_no_process_sees_what_another_has_not_finished(start, tmp_path: Path, monkeypatch) -> None:
    """A filled cache stays filled while a late process writes to it; what killed ones leave is in nobody's way."""
    cache = tmp_path / "cache"
    monkeypatch.setenv("SURFACECHEM_CACHE", str(cache))
    for last in range(len(STEPS) + 1):
        killed = start(BY_STEPS)
        for step in pauses(killed):
            if step == last:
                killed.kill()
                break
        killed.communicate()
        assert killed.returncode < 0
    late = start(BY_STEPS)
    for step in pauses(late):
        if step == 0:
            assert finish(start()) == MADE
            (folder,) = cache.iterdir()
        assert stored_code(folder) is not None
    assert step >= len(STEPS)
    late.communicate()
    assert finish(start()) == FOUND


def test_what_cannot_be_written_is_made_for_one_process(start, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    assert finish(start(cache=tmp_path / "file" / "cache"), "cannot be kept") == NOT_KEPT
    # No file may grow beyond nothing: every write fails as on a full disk.
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"
    assert finish(start(full), "cannot be kept") == NOT_KEPT


def test_what_is_kept_is_found_from_everywhere(start, tmp_path: Path) -> None:
    """It is writable to oneself alone, and one kernel wherever its sources are."""
    assert finish(start("import os; os.umask(0o002)")) == MADE
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "tiny_kernel.py").rename(tmp_path / "elsewhere" / "tiny_kernel.py")
    assert finish(start(here=tmp_path / "elsewhere")) == FOUND
    assert len(list((tmp_path / "cache").glob("*/*"))) == 1


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A folder with the code of the stepper of this machine."""
    stepper.LOOP.load()
    folder = tmp_path_factory.mktemp("cache") / stepper.LOOP.folder.name
    shutil.copytree(stepper.LOOP.folder, folder)
    return folder


def test_a_flipped_bit_is_never_loaded(kept: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    random, folder = Random(1), tmp_path / kept.name
    content = (kept / CODE_FILE).read_bytes()
    shutil.copytree(kept, folder)
    assert stored_code(folder) is not None
    for bit in (0, 8 * len(content) - 1, *(random.randrange(8 * len(content)) for _ in range(20))):
        damaged = bytearray(content)
        damaged[bit // 8] ^= 1 << bit % 8
        (folder / CODE_FILE).write_bytes(damaged)
        assert stored_code(folder) is None


def test_what_a_wheel_carries_is_taken_where_the_processor_runs_it(kept: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    monkeypatch.setattr(kernelcache, "SHIPPED_FOLDER", tmp_path / "wheel")
    shutil.copytree(kept, kernelcache.shipped_folder(stepper.sources(), tmp_path / "wheel"))
    monkeypatch.setitem(kernelcache.PLATFORMS, platform.machine().lower(), ("new", ("instructions to come",)))
    loop = stepper.Loop("none", stepper.sources(), "none.none", (), {})
    assert not loop.is_compiled
    monkeypatch.setitem(kernelcache.PLATFORMS, platform.machine().lower(), ("usual", ()))
    assert loop.is_compiled
    assert loop.load() is not None
    (loop.folder / CODE_FILE).write_bytes(b"damaged")
    # What is there is not written over, but made anew.
    assert not stepper.Loop("none", stepper.sources(), "none.none", (), {}).is_compiled


@pytest.fixture
def cut_off(kept: Path, tmp_path: Path) -> Path:
    """A cache whose code is cut off."""
    folder = tmp_path / "cache" / kept.name
    shutil.copytree(kept, folder)
    with (folder / CODE_FILE).open("r+b") as file:
        file.truncate(1000)
    return folder


def test_code_that_is_cut_off_is_not_called_but_made_anew(cut_off: Path, monkeypatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(cut_off.parent))
    loop = stepper.Loop("none", stepper.sources(), "none.none", (), {})
    assert not loop.is_compiled
    with pytest.raises(ModuleNotFoundError, match="none"):  # it would be compiled
        loop.load()


@pytest.mark.slow
def test_a_command_runs_where_the_cache_is_damaged(cut_off: Path, tmp_path: Path) -> None:
    """The run is that of every other day."""
    environment = {**os.environ, "SURFACECHEM_CACHE": str(cut_off.parent), "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", COMMAND, str(tmp_path / "run.nc")]
    subprocess.run(command, env=environment, check=True, timeout=300)
    assert stored_code(cut_off) is not None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="permissions of POSIX")
def test_a_cache_that_another_user_can_write_to_is_refused(start, tmp_path: Path, monkeypatch) -> None:
    cache = tmp_path / "cache"
    monkeypatch.setenv("SURFACECHEM_CACHE", str(cache))
    (tmp_path / "elsewhere").mkdir(mode=0o755)
    (tmp_path / "elsewhere" / CODE_FILE).touch(mode=0o644)
    folder = kernelcache.kernel_folder([tmp_path / "tiny_kernel.py"])
    shutil.copytree(tmp_path / "elsewhere", folder)
    for path in (cache, folder, folder / CODE_FILE):
        usual = path.stat().st_mode
        path.chmod(usual | 0o020)
        assert "can be written by other users" in kernelcache.untrusted(folder)
        path.chmod(usual)
    assert kernelcache.untrusted(folder) is None
    shutil.rmtree(folder)
    folder.symlink_to(tmp_path / "elsewhere")
    assert finish(start(), "can be written by other users") == NOT_KEPT


def test_a_folder_that_another_process_removes_is_no_error(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "kernel" / "part").mkdir(parents=True)
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    scandir = os.scandir

    def gone(path):
        if Path(path).name == "part":
            raise FileNotFoundError(path)
        return scandir(path)

    monkeypatch.setattr(os, "scandir", gone)
    assert kernelcache.untrusted(tmp_path / "kernel") is None

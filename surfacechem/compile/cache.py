"""The folder that keeps the compiled stepper, and compiling with or without it.

The folder's name holds a digest of the kernel's sources, the versions of Numba and Python and the processor, so that
code is never reused where it does not fit. What is kept is machine code: it is loaded only where its SHA-256 is the one
noted when it was made, and where no other user could have written it. Each file is written aside, takes its name when
it is whole, and is never removed: processes that compile at once do so each for itself and the last one's file stays,
as sound as the others'; none waits for another or sees what is half done. A cache that cannot be written, read or
trusted costs compile time, never a result.

A wheel that was built for a platform carries code for all its processors that are not old. Where that fits it is copied
into the folder instead of compiled.
"""

import gc
import hashlib
import os
import pickle
import platform
import shutil
import sys
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from surfacechem.documents import cache_folder
from surfacechem.documents.cache_folder import cache_root, keep_file, make_folder, sealed, unsealed

NUMBA_FILE = "kernel.numba"
"""File that Numba loads; others of the folder that begin with `kernel.` hold the same code in other forms."""


SHIPPED_FOLDER = Path(__file__).with_name("shipped")
"""Folder in which a wheel carries code that was compiled when it was built."""

V3 = ("x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"))
PLATFORMS = {"x86_64": V3, "amd64": V3}
"""Target processors of such code, by the name of a machine, with the instruction sets that they need; on other
machines it is generic.
"""


_version = cache(version)
"""Version of a library, which takes long to look up."""


def processor() -> str:
    """Name of the processor; where it is not told, the instruction sets Numba finds still guard the machine code."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            return next(line for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


def kernel_folder(sources: Sequence[Path]) -> Path:
    """Folder for code compiled from these sources on this machine."""
    return cache_root() / f"kernel-{_digest(sources, sys.version, processor())}"


def shipped_folder(sources: Sequence[Path], place: Path) -> Path:
    """Folder in a place for a wheel's code compiled from these sources for this platform."""
    return place / _digest(sources, sys.implementation.cache_tag)


def _digest(sources: Sequence[Path], *where: str) -> str:
    """A digest of all that compiled code depends on."""
    digest = hashlib.sha256()
    for text in (version("numba"), version("llvmlite"), platform.machine(), *where):
        digest.update(text.encode())
    # These files decide in which form code is kept.
    for source in (Path(cache_folder.__file__), Path(__file__), Path(__file__).with_name("objectcode.py"), *sources):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def copy_shipped(folder: Path, sources: Sequence[Path]) -> None:
    """Copy code that a wheel carries into a folder that is not there yet, if it fits and this processor runs it."""
    if folder.exists() or not SHIPPED_FOLDER.is_dir():  # as in a checkout, where no digest is formed in vain
        return
    import llvmlite.binding as llvm

    _, needed = PLATFORMS.get(platform.machine().lower(), ("", ()))
    # What it is found by comes last.
    files = sorted(shipped_folder(sources, SHIPPED_FOLDER).glob("kernel.*"), key=lambda path: path.name == NUMBA_FILE)
    if files and {*needed} <= {name for name, has in llvm.get_host_cpu_features().items() if has}:
        with suppress(OSError):  # what cannot be kept is compiled for each process
            make_folder(folder)
            for path in files:
                keep_file(folder / path.name, path.read_bytes())


def ship(sources: Sequence[Path], place: Path, load: Callable[[], object]) -> None:
    """Put what ``load`` compiles into a folder that a wheel is to carry; Numba must not have been imported before."""
    name, _ = PLATFORMS.get(platform.machine().lower(), ("generic", ()))
    os.environ |= {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": ""}
    load()
    from numba.core import serialize

    numbas: Any = serialize
    made, target = kernel_folder(sources), shipped_folder(sources, place)
    shutil.copytree(made, target)
    content = _content(made)
    assert content is not None
    keep_file(target / NUMBA_FILE, sealed(numbas.dumps((None, pickle.loads(content)[1]))))


def code_file(origins: Iterable[str]) -> Path:
    """File for the machine code of expressions that follows from these texts on this machine."""
    libraries = map(_version, ("symengine", "llvmlite"))
    digest = hashlib.sha256("\n".join((*libraries, platform.machine(), processor(), *origins)).encode())
    return cache_root() / "code" / digest.hexdigest()[:32]


def is_filled(folder: Path) -> bool:
    """Whether the folder holds machine code that would be loaded."""
    return untrusted(folder) is None and _content(folder) is not None


def _content(folder: Path) -> bytes | None:
    """Content of the file that Numba loads; None where it, or one made with it, is damaged: all is then made anew."""
    try:
        contents = {path.name: unsealed(path.read_bytes()) for path in folder.glob("kernel.*")}
    except OSError:
        return None
    return None if None in contents.values() else contents.get(NUMBA_FILE)


def untrusted(folder: Path) -> str | None:
    """Reason why code in this folder could be another user's; None where it cannot be, or the folder is not there."""
    inside = (Path(place, name) for place, folders, files in os.walk(folder) for name in (*folders, *files))
    return cache_folder.untrusted((folder, *inside))


class _KernelCache:
    """Cache in which Numba looks up and keeps the machine code of a function: one file, wherever the sources are."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.cache_path = str(folder)

    def load_overload(self, _signature: Any, context: Any) -> Any:
        """Load code compiled for a processor like this one or, by a wheel, for all; None where none is sound."""
        from numba.core.compiler import CompileResult

        content = _content(self.folder)
        if content is None:
            return None
        context.refresh()
        processor, reduced = pickle.loads(content)
        result: Any = CompileResult
        fits = processor is None or processor == context.codegen().magic_tuple()
        return result._rebuild(context, *reduced) if fits else None

    def save_overload(self, _signature: Any, compiled: Any) -> None:
        """Keep what has just been compiled."""
        from numba.core import serialize

        numbas: Any = serialize
        if compiled.library.has_dynamic_globals:
            _warn(self.folder, "it holds addresses of this process")
            return
        data = sealed(numbas.dumps((compiled.codegen.magic_tuple(), compiled._reduce())))
        try:
            make_folder(self.folder)
            keep_file(self.folder / NUMBA_FILE, data)
        except OSError as error:
            _warn(self.folder, str(error))


def _warn(folder: Path, problem: str) -> None:
    warnings.warn(
        f"The compiled stepper cannot be kept in {folder} ({problem}); it is compiled for this process alone. "
        "SURFACECHEM_CACHE names another folder.",
        stacklevel=3,
    )


def _numba_patches(parts: Collection[str]) -> list[tuple[Any, str, Any]]:
    """Patches (object, attribute, value) with which Numba compiles a kernel of these parts in half the usual time."""
    import numba
    from numba.core import llvm_bindings
    from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
    from numba.core.targetconfig import TargetConfig

    library: Any = JITCodeLibrary
    codegen: Any = JITCPUCodegen
    flags: Any = TargetConfig
    llvm: Any = vars(llvm_bindings)["llvm"]
    optimise, finalise = library._optimize_final_module, library._finalize_final_module
    set_environment, pass_builder, digests = codegen.set_env, llvm.create_pass_builder, dict[Any, int]()

    # Numba optimises and translates every function together with all it calls, level by level, as if each were called
    # from Python. Of the parts of a kernel only the code between is kept; the whole is optimised and translated once.
    def optimise_whole(self: Any) -> None:
        if self.name not in parts:
            optimise(self)

    def finalise_whole(self: Any) -> None:
        if self.name in parts:
            self._finalized = True
        else:
            finalise(self)

    def set_environment_of_whole(self: Any, name: str, environment: Any) -> None:
        if self._engine.is_symbol_defined(name):
            set_environment(self, name, environment)

    # Loops over a handful of states or stages as they stand: four at a time there is more to decide than to do.
    def without_unrolling(machine: Any, options: Any) -> Any:
        options.loop_unrolling = False
        return pass_builder(machine, options)

    # Numba finds what it has compiled by the flags it did so with, and lists all of them at every look, a tenth of the
    # time; here only where those that are set differ.
    def digest(self: Any) -> int:
        kind = type(self)
        if kind not in digests:
            digests[kind] = hash(tuple(sorted(kind.options)))
        return digests[kind]

    def same(self: Any, other: Any) -> bool:
        return isinstance(other, flags) and bool(self._values == other._values or self.values() == other.values())

    return [
        (library, "_optimize_final_module", optimise_whole),
        (library, "_finalize_final_module", finalise_whole),
        (codegen, "set_env", set_environment_of_whole),
        (llvm, "create_pass_builder", without_unrolling),
        (flags, "__hash__", digest),
        (flags, "__eq__", same),
        # Vectorising short loops slows them down.
        (numba.config, "LOOP_VECTORIZE", 0),
    ]


@contextmanager
def _patched_numba(parts: Collection[str]) -> Iterator[None]:
    """Numba with its changes, which are put back afterwards: they are global and belong to the caller's own functions,
    too.
    """
    changes = _numba_patches(parts)
    usual = [getattr(owner, name) for owner, name, _ in changes]
    collecting = gc.isenabled()
    try:
        # What Numba makes on the way lives until the end: a tenth of the time would go into looking for what does not.
        gc.disable()
        for owner, name, changed in changes:
            setattr(owner, name, changed)
        yield
    finally:
        for (owner, name, _), before in zip(changes, usual, strict=True):
            setattr(owner, name, before)
        if collecting:
            gc.enable()


def compile_kernel(function: Callable[..., None], signature: Any, folder: Path, parts: Collection[str] = ()) -> Any:
    """The compiled function, from the cache if it is sound and ours, else compiled anew, and kept where that can be;
    parts are the names of the compiled functions that it alone calls.
    """
    import numba
    from numba.core.compiler_lock import global_compiler_lock

    kernel: Any = numba.njit(nogil=True, error_model="numpy")(function)
    problem = untrusted(folder)
    if problem is None:
        kernel._cache = _KernelCache(folder)
    else:
        _warn(folder, problem)
    with global_compiler_lock, _patched_numba(parts):
        kernel.compile(signature)
    kernel.disable_compile()
    return kernel

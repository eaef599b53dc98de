"""The cache folder of the compiled stepper, and compilation with or without it.

The folder's name contains a digest of the kernel's sources, the versions of Numba and Python and the processor, so that
code is never reused where it does not fit. Machine code is loaded only if its SHA-256 is the recorded one, and if no
other user could have written it. Each file is written under a temporary name, renamed when complete, and never removed.
Processes that compile at the same time each compile for themselves, and any of their files is valid: none waits for
another or sees an incomplete file. A cache that cannot be written, read or trusted costs compile time, never a result.

A wheel built for a platform contains code for all its processors except old ones. If it fits, it is copied into the
folder instead of being compiled.
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
from pathlib import Path
from typing import Any

from surfacechem.documents import cache_folder
from surfacechem.documents.cache_folder import cache_root, keep_file, make_folder, sealed, unsealed, version

NUMBA_FILE = "kernel.numba"
"""File that Numba loads; other files of the folder that begin with `kernel.` contain the same code in other forms."""


SHIPPED_FOLDER = Path(__file__).with_name("shipped")
"""Folder of a wheel with code that was compiled when it was built."""

V3 = ("x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"))
PLATFORMS = {"x86_64": V3, "amd64": V3}
"""Target processors of such code, by machine name, with the instruction sets that they need; generic on other
machines.
"""


def processor() -> str:
    """Return the name of the processor; if unknown, Numba's list of instruction sets still protects the code."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            return next(line for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


def kernel_folder(sources: Sequence[Path]) -> Path:
    """Return the folder for code compiled from these sources on this machine."""
    return cache_root() / f"kernel-{_digest(sources, sys.version, processor())}"


def shipped_folder(sources: Sequence[Path], place: Path) -> Path:
    """Return the folder inside ``place`` for a wheel's code compiled from these sources for this platform."""
    return place / _digest(sources, sys.implementation.cache_tag)


def _digest(sources: Sequence[Path], *where: str) -> str:
    """Return a digest of everything that compiled code depends on."""
    digest = hashlib.sha256()
    for text in (version("numba"), version("llvmlite"), platform.machine(), *where):
        digest.update(text.encode())
    # These files determine the form of stored code.
    for source in (Path(cache_folder.__file__), Path(__file__), Path(__file__).with_name("objectcode.py"), *sources):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def copy_shipped(folder: Path, sources: Sequence[Path]) -> None:
    """Copy code of a wheel into a folder that does not exist yet, if it fits and this processor runs it."""
    if folder.exists() or not SHIPPED_FOLDER.is_dir():  # in a checkout: no digest is needed
        return
    import llvmlite.binding as llvm

    _, needed = PLATFORMS.get(platform.machine().lower(), ("", ()))
    # The file by which the folder counts as filled comes last.
    files = sorted(shipped_folder(sources, SHIPPED_FOLDER).glob("kernel.*"), key=lambda path: path.name == NUMBA_FILE)
    if files and {*needed} <= {name for name, has in llvm.get_host_cpu_features().items() if has}:
        with suppress(OSError):  # without a cache each process compiles
            make_folder(folder)
            for path in files:
                keep_file(folder / path.name, path.read_bytes())


def ship(sources: Sequence[Path], place: Path, load: Callable[[], object]) -> None:
    """Copy the code that ``load`` compiles into a folder for a wheel; Numba must not have been imported before."""
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
    """Return the file for the machine code of expressions that follows from these texts on this machine."""
    libraries = map(version, ("symengine", "llvmlite"))
    digest = hashlib.sha256("\n".join((*libraries, platform.machine(), processor(), *origins)).encode())
    return cache_root() / "code" / digest.hexdigest()[:32]


def is_filled(folder: Path) -> bool:
    """True if the folder contains machine code that would be loaded."""
    return untrusted(folder) is None and _content(folder) is not None


def _content(folder: Path) -> bytes | None:
    """Return the content of the file that Numba loads; None if any file made with it is damaged."""
    try:
        contents = {path.name: unsealed(path.read_bytes()) for path in folder.glob("kernel.*")}
    except OSError:
        return None
    return None if None in contents.values() else contents.get(NUMBA_FILE)


def untrusted(folder: Path) -> str | None:
    """Return the reason why code in this folder could be another user's; None if it cannot, or without a folder."""
    inside = (Path(place, name) for place, folders, files in os.walk(folder) for name in (*folders, *files))
    return cache_folder.untrusted((folder, *inside))


class _KernelCache:
    """Cache in which Numba looks up a function's machine code: one file, independent of the place of the sources."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.cache_path = str(folder)

    def load_overload(self, _signature: Any, context: Any) -> Any:
        """Load code compiled for this processor or, in a wheel, for all; None if there is no valid code."""
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
        """Store the code that has just been compiled."""
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
    """Return patches (object, attribute, value) with which Numba compiles a kernel of these parts twice as fast."""
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

    # Numba optimises and translates every function together with all that it calls, level by level, for calls
    # from Python. For parts of a kernel only the intermediate code is kept; the whole is optimised and translated once.
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

    # No unrolling: loops over a few states or stages would mostly test for their ends.
    def without_unrolling(machine: Any, options: Any) -> Any:
        options.loop_unrolling = False
        return pass_builder(machine, options)

    # Numba looks up compiled functions by all their flags, and lists these at every lookup, which takes a tenth of the
    # time; here only if the flags that are set differ.
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
    """Patch Numba temporarily: the patches are global and would affect the caller's functions too."""
    changes = _numba_patches(parts)
    usual = [getattr(owner, name) for owner, name, _ in changes]
    collecting = gc.isenabled()
    try:
        # Numba's objects live until the end: the garbage collector would take a tenth of the time for nothing.
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
    """Return the compiled function: from the cache if it is valid and trusted, else compiled, and stored if possible.

    ``parts`` are the names of the compiled functions that only the kernel calls.
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

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
import platform
import shutil
import sys
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from surfacechem.documents import cache_folder
from surfacechem.documents.cache_folder import cache_root, keep_file, make_folder, sealed, unsealed, version

CODE_FILE = "kernel.object"
"""File of the machine code."""

SHIPPED_FOLDER = Path(__file__).with_name("shipped")
"""Folder of a wheel with code that was compiled when it was built."""

V3 = ("x86-64-v3", ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"))
PLATFORMS = {"x86_64": V3, "amd64": V3}
"""Target processors of such code, by machine name, with the instruction sets that they need; generic on other
machines.
"""


@cache
def processor() -> str:
    """Return the name of the processor and its instruction sets, of which a virtual machine may hide some."""
    import llvmlite.binding as llvm

    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


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
    if {*needed} <= {name for name, has in llvm.get_host_cpu_features().items() if has}:
        with suppress(OSError):  # without a cache each process compiles
            code = (shipped_folder(sources, SHIPPED_FOLDER) / CODE_FILE).read_bytes()
            make_folder(folder)
            keep_file(folder / CODE_FILE, code)


def ship(sources: Sequence[Path], place: Path, load: Callable[[], object]) -> None:
    """Copy the code that ``load`` compiles into a folder for a wheel; Numba must not have been imported before."""
    name, _ = PLATFORMS.get(platform.machine().lower(), ("generic", ()))
    os.environ |= {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": ""}
    load()
    shutil.copytree(kernel_folder(sources), shipped_folder(sources, place))


def code_file(origins: Iterable[str]) -> Path:
    """Return the file for the machine code of expressions that follows from these texts on this machine."""
    libraries = map(version, ("symengine", "llvmlite"))
    digest = hashlib.sha256("\n".join((*libraries, platform.machine(), processor(), *origins)).encode())
    return cache_root() / "code" / digest.hexdigest()[:32]


def untrusted(folder: Path) -> str | None:
    """Return the reason why code in this folder could be another user's; None if it cannot, or without a folder."""
    inside = (Path(place, name) for place, folders, files in os.walk(folder) for name in (*folders, *files))
    return cache_folder.untrusted((folder, *inside))


def stored_code(folder: Path) -> bytes | None:
    """Return the code that is stored in a folder; None if there is none, or none that can be trusted."""
    with suppress(OSError):
        return None if untrusted(folder) else unsealed((folder / CODE_FILE).read_bytes())
    return None


def store_code(folder: Path, code: bytes) -> None:
    """Store code that has just been compiled; warn if the folder cannot be written to or trusted."""
    if (problem := untrusted(folder)) is None:
        try:
            make_folder(folder)
            keep_file(folder / CODE_FILE, sealed(code))
        except OSError as error:
            problem = str(error)
    if problem is not None:
        warnings.warn(
            f"The compiled stepper cannot be kept in {folder} ({problem}); it is compiled for this process alone. "
            "SURFACECHEM_CACHE names another folder.",
            stacklevel=2,
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


def compile_kernel(function: Callable[[int, int], None], parts: Collection[str] = ()) -> bytes:
    """Return the machine code of a function of two integers, preceded by a line with its name.

    ``parts`` are the names of the compiled functions that only this one calls.
    """
    import numba
    from numba.core.compiler_lock import global_compiler_lock

    compile_alone: Any = numba.njit(error_model="numpy", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)
    kernel = compile_alone(function)
    with global_compiler_lock, _patched_numba(parts):
        kernel.compile("void(int64, int64)")
    (made,) = kernel.overloads.values()
    _, _, (code, _) = made.library.serialize_using_object_code()
    return b"%s\n%s" % (made.fndesc.llvm_func_name.encode(), code)

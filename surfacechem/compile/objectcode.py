"""The compiled stepper without its compiler: machine code made by Numba, loaded and called without it.

Importing Numba takes half of the time of a brief process. The code does not need it: LLVM alone loads the code in a
tenth of that time. A call takes some ten microseconds longer than through Numba, so only processes with few calls use
it.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from surfacechem.compile.cache import untrusted
from surfacechem.documents.cache_folder import keep_file, sealed, unsealed

OBJECT_FILE = "kernel.object"

UNUSED_SYMBOLS = (
    "NRT_Free",
    "NRT_MemInfo_call_dtor",
    "NRT_adapt_ndarray_from_python",
    "numba_do_raise",
    "numba_gil_ensure",
    "numba_gil_release",
    "numba_runtime_build_excinfo_struct",
    "numba_unpickle",
)
"""Symbols that only the unused entry from Python calls: they are bound to code that ends the process."""

LOADING_TIMEOUT = 60.0
"""Time [s] after which the test process that loads the code has failed."""

LOADING_TEST = """
import sys
from pathlib import Path
from surfacechem.compile.objectcode import load
assert load(Path(sys.argv[1])) is not None
"""


def keep(kernel: Any, folder: Path) -> None:
    """Store the machine code of a kernel that Numba has just compiled; only if a separate process can load it."""
    if untrusted(folder) is not None:
        return
    (made,) = kernel.overloads.values()
    try:
        _, _, (code, _) = made.library.serialize_using_object_code()
    except RuntimeError:
        return  # the kernel came from the cache, and its code with it
    data = sealed(made.fndesc.llvm_func_name.encode() + b"\n" + code)
    with suppress(OSError, subprocess.SubprocessError), tempfile.TemporaryDirectory(dir=folder) as trial:
        keep_file(Path(trial) / OBJECT_FILE, data)
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        command = [sys.executable, "-P", "-c", LOADING_TEST, trial]
        done = subprocess.run(command, env=environment, capture_output=True, timeout=LOADING_TIMEOUT)
        if done.returncode == 0:
            keep_file(folder / OBJECT_FILE, data)


def load(folder: Path) -> Callable[..., None] | None:
    """Return the kernel whose code is stored in a folder; None if there is none that can be trusted."""
    if untrusted(folder) is not None:
        return None
    try:
        content = unsealed((folder / OBJECT_FILE).read_bytes())
    except OSError:
        return None
    if content is None:
        return None
    name, _, code = content.partition(b"\n")
    return Kernel(name.decode(), code)


def engine(code: bytes, unused: Sequence[str] = ()) -> Any:
    """Return an engine that holds machine code; calls of the ``unused`` symbols end the process."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    missing = llvm.parse_assembly("\n".join(f"declare void @{name}()" for name in unused))
    found = llvm.create_mcjit_compiler(missing, machine)  # takes ownership of both
    abort = ctypes.cast(ctypes.CDLL(None).abort, ctypes.c_void_p).value if unused else None
    for name in unused:  # in this engine only: Numba may be running in the same process
        found.add_global_mapping(missing.get_function(name), abort)
    found.add_object_file(llvm.ObjectFileRef.from_data(code))
    found.finalize_object()
    return found


class Kernel:
    """Machine code of a function without results, of integers, floats, contiguous arrays and tuples of these."""

    def __init__(self, name: str, code: bytes) -> None:
        self._engine = engine(code, UNUSED_SYMBOLS)
        self._address = self._engine.get_function_address(name)
        self._call: Any = None
        self._nothing, self._error = ctypes.c_void_p(), ctypes.c_void_p()

    def __call__(self, *arguments: Any) -> None:
        """Call the kernel; it releases the interpreter lock."""
        words = _words(arguments)
        if self._call is None:
            kinds = [ctypes.c_double if isinstance(word, float) else ctypes.c_int64 for word in words]
            code = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *kinds)
            self._call = code(self._address)
        status = self._call(ctypes.addressof(self._nothing), ctypes.addressof(self._error), *words)
        if status != 0:
            raise RuntimeError(f"the compiled stepper ended with status {status}")


def _words(argument: Any) -> Sequence[Any]:
    """Return an argument as Numba passes it: a tuple entry by entry; of an array its owners, number and size of
    entries, address, shape, strides.
    """
    if isinstance(argument, tuple):
        return [word for entry in argument for word in _words(entry)]
    if isinstance(argument, np.ndarray):
        return (0, 0, argument.size, argument.itemsize, argument.ctypes.data, *argument.shape, *argument.strides)
    return (argument,)

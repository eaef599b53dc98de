"""Machine code without its compiler: LLVM alone loads what Numba has compiled, sooner than Numba is imported."""

import ctypes
import struct
from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

HEAD = object.__basicsize__
DATA, SHAPE = HEAD, HEAD + 2 * ctypes.sizeof(ctypes.c_void_p)
"""Places of the addresses of the entries and of the lengths in an array of NumPy.

Source: PyArrayObject_fields in the reference of NumPy's C interface: the head of a Python object, then a pointer to the
data, the number of axes, and pointers to shape and strides.
"""


def engine(code: bytes) -> Any:
    """Return an engine that holds machine code."""
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    found = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)  # takes ownership of both
    found.add_object_file(llvm.ObjectFileRef.from_data(code))
    found.finalize_object()
    return found


class Kernel:
    """Machine code of a function of a number of runs and of a table of the addresses of arrays."""

    def __init__(self, code: bytes) -> None:
        name, _, code = code.partition(b"\n")
        self._engine = engine(code)
        address = self._engine.get_function_address(name.decode())
        pointer = ctypes.c_void_p
        self._call = ctypes.CFUNCTYPE(ctypes.c_int32, pointer, pointer, ctypes.c_int64, pointer)(address)
        self._nothing, self._error = ctypes.byref(pointer()), ctypes.byref(pointer())

    def __call__(self, count: int, arrays: Sequence[NDArray[Any]]) -> None:
        """Call the kernel for this number of runs; it releases the interpreter lock.

        The arrays are contiguous and of the types that the kernel declares.
        """
        table = struct.pack(f"{len(arrays)}P", *map(id, arrays))
        status = self._call(self._nothing, self._error, count, table)
        if status != 0:
            raise RuntimeError(f"the compiled stepper ended with status {status}")

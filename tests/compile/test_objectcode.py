"""The stepper without its compiler: how it reads arrays, and that it is given none of another form."""

import ctypes

import numba
import numpy as np
import pytest

import surfacechem
from surfacechem.compile import objectcode
from surfacechem.solve.radau import stepper


def word(address):
    return ctypes.c_int64.from_address(address).value


def test_where_an_array_has_its_entries_and_lengths():
    array = np.zeros((3, 5))
    assert word(id(array) + objectcode.DATA) == array.ctypes.data
    lengths = word(id(array) + objectcode.SHAPE)
    assert [word(lengths), word(lengths + 8)] == [3, 5]


def lsoda(case):
    surfacechem.run(case, {"run.solver": "lsoda"})


@pytest.mark.parametrize(
    ("use", "case"),
    [
        (surfacechem.run, "stick-slip-debonding"),
        (surfacechem.run, "dna-adhesive"),
        (lsoda, "three-temperatures-no-capacity"),
        (surfacechem.sweep, "catch-bond"),
    ],
)
def test_arrays_have_the_form_that_the_stepper_reads(use, case, monkeypatch):
    forms, call = [], objectcode.Kernel.__call__

    def seen(kernel, count, arrays):
        forms.append([(array.dtype, array.ndim, array.flags.c_contiguous) for array in arrays])
        call(kernel, count, arrays)

    monkeypatch.setattr(objectcode.Kernel, "__call__", seen)
    use(case)
    declared = [(np.dtype(kind), axes, True) for kind, axes in [*stepper.BATCH.values(), (np.int64, 1)]]
    assert forms
    assert all(form == declared for form in forms)


def test_numba_compiles_on_in_a_process_that_has_loaded_the_code():
    stepper.LOOP.load()
    doubled = numba.njit(lambda x: 2.0 * x)(np.ones(3))
    assert doubled.tolist() == [2.0, 2.0, 2.0]


def test_a_kernel_that_fails_says_so(monkeypatch):
    kernel = stepper.LOOP.load()
    monkeypatch.setattr(kernel, "_call", lambda *_: 1)
    with pytest.raises(RuntimeError, match="ended with status 1"):
        kernel(1, [])

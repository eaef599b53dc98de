"""The stepper without its compiler: the same bits, sooner; and what is no sound code is not used."""

from dataclasses import replace
from types import SimpleNamespace as Some

import numba
import numpy as np
import pytest

import surfacechem
from surfacechem.compile import objectcode
from surfacechem.solve.radau import stepper


@pytest.fixture(scope="module")
def bare():
    stepper.LOOP.load()
    kernel = objectcode.load(stepper.LOOP.folder)
    if kernel is None:
        pytest.skip("the code of this machine's stepper cannot be loaded by itself")
    return kernel


@pytest.mark.parametrize("name", ["debonding", "three-temperatures-no-capacity"])
def test_the_same_bits(bare, name, monkeypatch):
    simulation = surfacechem.load(name)
    run = replace(simulation.case.run, rtol=1e-7, atol=None)
    usual = simulation.model.solve(run).result
    monkeypatch.setattr(stepper.LOOP, "_kernel", bare)
    again = simulation.model.solve(run).result
    assert again.counters == usual.counters
    np.testing.assert_array_equal(again.outputs, usual.outputs)
    np.testing.assert_array_equal(again.ledger_outputs, usual.ledger_outputs)


def test_numba_compiles_on_in_a_process_that_has_loaded_the_code(bare):
    doubled = numba.njit(lambda x: 2.0 * x)(np.ones(3))
    assert doubled.tolist() == [2.0, 2.0, 2.0]


@pytest.mark.parametrize("content", [None, b"damaged", b"kernel\ncode"])
def test_what_is_no_code_is_not_loaded(tmp_path, content):
    (tmp_path / "folder").mkdir(mode=0o755)
    if content is not None:
        (tmp_path / "folder" / objectcode.OBJECT_FILE).write_bytes(content)
    assert objectcode.load(tmp_path / "folder") is None


def no_code():
    return "kernel", "object", (b"no machine code", b"")


def no_code_but_that_of_the_cache():
    raise RuntimeError("no compiled object yet")


@pytest.mark.parametrize("serialize", [no_code, no_code_but_that_of_the_cache])
def test_code_that_no_process_can_load_is_not_kept(serialize, tmp_path):
    library, described = Some(serialize_using_object_code=serialize), Some(llvm_func_name="kernel")
    kernel = Some(overloads={(): Some(library=library, fndesc=described)})
    objectcode.keep(kernel, tmp_path)
    assert list(tmp_path.iterdir()) == []
    objectcode.keep(kernel, tmp_path / "nowhere")


def test_a_kernel_that_fails_says_so(bare):
    failing = objectcode.Kernel.__new__(objectcode.Kernel)
    failing.__dict__.update(bare.__dict__, _call=lambda *_: 1)
    with pytest.raises(RuntimeError, match="ended with status 1"):
        failing(0)

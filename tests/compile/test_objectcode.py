"""The stepper without its compiler: the same bits, sooner; and what is no sound code is not used."""

import os
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace as Some

import numpy as np
import pytest

import surfacechem
from surfacechem.compile import objectcode
from surfacechem.solve.radau import stepper

COMMAND = """
import sys
from surfacechem.cli import app
app(["run", "exothermic", "-q", "-o", sys.argv[1]], standalone_mode=False)
print("numba" in sys.modules)
"""


@pytest.fixture(scope="module")
def bare():
    stepper.compile_stepper()
    kernel = objectcode.load(stepper._folder())
    if kernel is None:
        pytest.skip("the code of this machine's stepper cannot be loaded by itself")
    return kernel


@pytest.mark.parametrize("name", ["exothermic", "debonding", "three-temperatures-no-capacity", "epoxy-cure-thick"])
def test_the_same_bits(bare, name, monkeypatch):
    simulation = surfacechem.load(name)
    run = replace(simulation.case.run, rtol=1e-7, atol=None)
    usual = simulation.model.solve(run).result
    calls = []

    def counted(*arguments):
        calls.append(len(arguments))
        bare(*arguments)

    monkeypatch.setattr(stepper, "run_batch", lambda: counted)
    again = simulation.model.solve(run).result
    assert calls
    assert again.counters == usual.counters
    np.testing.assert_array_equal(again.outputs, usual.outputs)
    np.testing.assert_array_equal(again.ledger_outputs, usual.ledger_outputs)


def test_a_brief_command_does_without_the_compiler(bare, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, str(tmp_path / "run.nc")],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.stdout.split() == ["False"]


def test_where_no_code_is_kept_there_is_none(tmp_path):
    assert objectcode.load(tmp_path) is None


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

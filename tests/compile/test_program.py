"""Machine code from expressions."""

from dataclasses import replace

import numpy as np
import pytest
import symengine as se

import surfacechem
from surfacechem.compile import program
from surfacechem.compile.program import compile_function, compile_program
from surfacechem.solve.radau.stepper import LOOP
from surfacechem.solve.run import Model


def test_machine_code_is_loaded_where_it_is_of_the_same_expressions(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    x, y = se.symbols("x y")
    tenth = 0.1 * se.exp(x) / (y + 3 * x)

    def made(*expressions: se.Basic) -> np.ndarray:
        program._machine_code.cache_clear()  # as in another process
        return compile_function([x, y], expressions)([0.3, 0.7])

    first = made(tenth, x + y)
    assert len(list((tmp_path / "code").iterdir())) == 1
    with monkeypatch.context() as patch:
        patch.setattr(se, "Lambdify", lambda *_, **__: pytest.fail("made again"))
        np.testing.assert_array_equal(made(tenth, x + y), first)
    assert made(tenth * (1 + np.finfo(float).eps), x + y)[0] != first[0]  # another last digit, which is not printed
    assert made(x + y, tenth).tolist() == first[::-1].tolist()
    for file in (tmp_path / "code").iterdir():
        file.write_bytes(file.read_bytes()[:-1])
    np.testing.assert_array_equal(made(tenth, x + y), first)


def test_the_code_of_a_jacobian_is_loaded_without_differentiating(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    t, x, dx, r = se.symbols("t x dx r")

    def made(power: int) -> list[float]:
        program._machine_code.cache_clear()  # as in another process
        return compile_program(t, [x], [dx], [], [dx + r], named=[(r, x**power)]).jacobian([0.0, 3.0, 0.0]).tolist()

    assert made(2) == [6.0, 1.0]
    with monkeypatch.context() as patch:
        patch.setattr(program, "_entries", lambda *_: pytest.fail("differentiated again"))
        assert made(2) == [6.0, 1.0]
    assert made(3) == [27.0, 1.0]


CELLS = "sudden-contact", ["bodies.epoxy.conduction.cells=20", "run.rtol=1e-4"]


@pytest.mark.parametrize("case", [("dna-adhesive", []), ("stick-slip", []), CELLS])
def test_a_scene_that_was_compiled_before_is_read_and_gives_the_same_bits(case, tmp_path, monkeypatch) -> None:
    LOOP.load()  # from the usual folder
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))

    def run() -> list[bytes]:
        for cache in (program._compiled, program._machine_code):
            cache.cache_clear()  # as in another process
        found = surfacechem.load(*case).run().trajectory.result
        return [table.tobytes() for table in (found.times, found.y, found.outputs, found.ledger_outputs)]

    first = run()
    with monkeypatch.context() as patch:
        patch.setattr(program.Equations, "parts", lambda *_: pytest.fail("compiled again"))
        patch.setattr(Model, "_compiled_outputs", lambda *_: pytest.fail("compiled again"))
        assert run() == first
    for file in (tmp_path / "code").iterdir():
        file.write_bytes(file.read_bytes()[:-1])
    assert run() == first


def test_code_is_kept_by_expressions_structure_and_sources(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    x, made = se.Symbol("x"), []

    def count(lengths: tuple[int, ...], *expressions: se.Basic) -> int:
        program._compiled.cache_clear()  # as in another process
        program.kept(lambda: made.append(0), program.key_of(expressions, lengths))
        return len(made)

    assert [count((1, 1), x, x + 0.1) for _ in range(2)] == [1, 1]
    assert count((2, 0), x, x + 0.1) == 2
    assert count((1, 1), x, x + np.nextafter(0.1, 1)) == 3
    assert count((1, 1), x, x + 0.4) == 4  # SymEngine's hash is that of x + 0.1
    assert count((1, 1), x, se.Symbol("y") + 0.1) == 5
    assert count((1, 1), x) == 6
    with monkeypatch.context() as patch:
        patch.setattr(program, "_source_digests", lambda: ["another"])
        assert count((1, 1), x) == 7
    assert count((1, 1), x) == 7
    for nothing in range(8, 10):
        program.kept(lambda: made.append(0), None)
        assert len(made) == nothing


def test_code_does_not_depend_on_where_a_case_lies(tmp_path, monkeypatch) -> None:
    """Nor on its title or its laws' names: equations alone make it."""
    (tmp_path / "other.yaml").write_text(
        surfacechem.load("dna-adhesive").case.text.replace("title: ", "title: Another ")
    )
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path / "cache"))
    first = surfacechem.load("dna-adhesive").model.program.key
    assert surfacechem.load(tmp_path / "other.yaml").model.program.key == first
    assert surfacechem.load("dna-adhesive", ["heat.conductance.h=2 kW/m^2/K"]).model.program.key == first
    assert surfacechem.load("exothermic").model.program.key != first


def test_a_system_with_less_in_it_is_another_one() -> None:
    system = surfacechem.load("dna-adhesive").system
    whole, bare = Model(system), Model(replace(system, ledger=(), named=system.named[:-1]))
    assert (bare.program.n_ledger, bare.program.ledger) == (0, None)
    assert bare.output_function.n_out == whole.output_function.n_out - system.named[-1].output


def test_counts_must_agree() -> None:
    t, x, dx = se.symbols("t x dx")
    with pytest.raises(ValueError, match="as many equations as states"):
        compile_program(t, [x], [dx], [], [dx, x])


@pytest.mark.parametrize("cells", [4, 40])
def test_derivatives_along_chains_are_those_of_all_states(cells):
    """Few are formed one and all, of many those that may not be zero."""
    model = surfacechem.load("sudden-contact", [f"bodies.epoxy.conduction.cells={cells}"]).model
    system, program = model.system, model.program
    states, rates = [s.symbol for s in system.states], [s.dot for s in system.states]
    rows = [system.expand(row) for row in system.rows.values()]
    whole = compile_program(system.t, states, rates, [p.symbol for p in system.parameters], rows)
    assert program.chains
    assert not whole.chains
    inputs = np.random.default_rng(1).uniform(300.0, 400.0, program.n_inputs)
    for own, all_ in zip(program.derivatives(inputs), whole.derivatives(inputs), strict=True):
        np.testing.assert_allclose(own, all_, rtol=1e-12)

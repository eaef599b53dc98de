"""Formulas as MathML."""

import pytest

from surfacechem.studies.report import mathml

pytestmark = pytest.mark.around


def test_lines_stand_below_each_other_and_align():
    found = mathml(r"\begin{aligned}a&=b,\\c&=d\end{aligned}")
    assert found.count("<mtr>") == 2
    assert "<mi>&</mi>" not in found


def test_brackets_of_a_given_size_enclose_all_between_them():
    assert mathml(r"\Big\{\Big(x\Big)^2\Big\}") == mathml(r"\left\{\left(x\right)^2\right\}")


def test_a_function_is_set_off_unless_a_bracket_follows():
    assert 'rspace="0.167em">ln</mo><mi>x' in mathml(r"\ln x")
    assert 'rspace="0">ln</mo>' in mathml(r"\ln(x)")

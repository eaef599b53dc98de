"""The package's structure gets no worse: every figure of house.py keeps its bound."""

import house
import pytest

pytestmark = pytest.mark.around


@pytest.mark.parametrize("title", house.bounds())
def test_a_figure_keeps_its_bound(title):
    """Where a figure has become better, `python tests/house.py --tighten` writes it down."""
    figure, bound = house.figures()[title], house.bounds()[title]
    places = "; ".join(f"{place} ({part:g})" for place, part in figure.worst(10))
    assert not house.worse(title, figure.value, bound), f"{title}: {figure.value:g}, bound {bound:g}. Largest: {places}"


def test_every_figure_has_a_bound():
    assert house.bounds().keys() == house.figures().keys()


def test_a_bound_is_only_tightened():
    now = {title: figure.value for title, figure in house.figures().items()}
    loose = {title: value + (-1 if title in house.MORE_IS_BETTER else 1) for title, value in now.items()}
    tight = {title: value + (1 if title in house.MORE_IS_BETTER else -1) for title, value in now.items()}
    assert house.tightened(loose) == now
    assert house.tightened(tight) == tight
    assert all(house.worse(title, value, tight[title]) for title, value in now.items())

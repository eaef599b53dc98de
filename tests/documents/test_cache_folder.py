"""Numbers that are kept between processes are used only where they hold, and are those that were found."""

import os
from pathlib import Path

import numpy as np
import pytest

from surfacechem.contracts import fits
from surfacechem.documents import cache_folder
from surfacechem.documents.cache_folder import cached, fingerprint
from surfacechem.errors import Place
from surfacechem.laws import coolprop
from surfacechem.laws.free_energy import NormalStiffness
from surfacechem.surfaces.shapes import Heights

pytestmark = pytest.mark.around

NUMBERS = [[0.1, float("inf"), 1e-300], None, "a text"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path))
    return tmp_path / "numbers"


def never():
    pytest.fail("found again")


def law_of_a_notebook():
    class Spring(NormalStiffness):
        """A law of one's own."""

    return Spring(E_n=1.0)


def test_what_differs_anywhere_has_another_fingerprint():
    places = np.arange(40.0)
    heights = np.tile(np.add.outer(np.cos(places / 6), np.cos(places / 6)).ravel(), (2, 1))
    heights[1, 700] -= 1e-9  # which numpy does not show
    one, other, same = (Heights(x=places, y=places, z=z) for z in (*heights, heights[0].copy()))
    assert repr(one) == repr(other)
    assert fingerprint(one) == fingerprint(same) != fingerprint(other)
    assert len({fingerprint(*things) for things in ([1, 2], [[1, 2]], [12], [{1: 2}], ["1", "2"], [1.0, 2.0])}) == 6


def test_laws_are_told_by_what_they_say_and_those_of_ones_own_hold_in_this_process():
    law = NormalStiffness(E_n=1.0)
    assert fingerprint(law) == fingerprint(NormalStiffness(E_n=1.0, place=Place("x.yaml", 3)))
    assert fingerprint(law) != fingerprint(NormalStiffness(E_n=2.0))
    own, same_name = law_of_a_notebook(), law_of_a_notebook()
    assert fingerprint(own) == fingerprint(own) != fingerprint(same_name)
    assert (fingerprint(law).is_lasting, fingerprint(own).is_lasting) == (True, False)
    assert fingerprint(never) != fingerprint(never)


def test_numbers_are_found_once(folder):
    assert cached(fingerprint("x"), [], lambda: NUMBERS) == NUMBERS
    assert cached(fingerprint("x"), [], never) == NUMBERS
    assert cached(fingerprint("x"), [Path(__file__)], lambda: 2.0) == 2.0  # by other code
    assert cached(fingerprint("y"), [], lambda: 3.0) == 3.0
    assert len(list(folder.iterdir())) == 3


def test_what_nobody_can_compare_is_not_kept(folder):
    assert cached(fingerprint(law_of_a_notebook()), [], lambda: 1.0) == 1.0
    assert not folder.exists()


def cut(path):
    path.write_bytes(path.read_bytes()[:-1])


def shared(path):
    path.chmod(0o666)


@pytest.mark.parametrize("harm", [cut, shared])
def test_what_is_damaged_or_not_ours_is_found_again(folder, harm):
    cached(fingerprint("x"), [], lambda: 1.0)
    (path,) = folder.iterdir()
    harm(path)
    assert cached(fingerprint("x"), [], lambda: 2.0) == 2.0
    assert cached(fingerprint("x"), [], never) == 2.0


def test_of_too_many_files_the_older_half_goes(folder, monkeypatch):
    monkeypatch.setattr(cache_folder, "MOST_FILES", 3)

    def kept(x, value):
        return cache_folder.from_file(folder / f"0{x}", lambda: value, bytes.decode, str.encode)

    for age, x in enumerate("abcd"):
        kept(x, x)
        for path in folder.iterdir():
            os.utime(path, (path.stat().st_mtime - 60,) * 2)
        assert len(list(folder.iterdir())) == (2 if age == 3 else age + 1)
    assert [kept(x, "anew") for x in "dcb"] == ["d", "c", "anew"]


def test_a_folder_that_cannot_be_made_costs_nothing_but_time(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SURFACECHEM_CACHE", str(tmp_path / "file"))
    assert cached(fingerprint("x"), [], lambda: 1.0) == 1.0


@pytest.mark.usefixtures("folder")
def test_a_fit_comes_back_bit_by_bit_and_without_its_library(monkeypatch):
    fluid = coolprop.CoolPropFluid("Nitrogen", 2e5)
    fit, limits = coolprop._fit.__wrapped__, coolprop._limits.__wrapped__
    found = fit(fluid, "k_m", 290.0, 310.0, fits.FIT_ACCURACY), limits(fluid)
    monkeypatch.setattr(coolprop, "_coolprop", never)
    assert (fit(fluid, "k_m", 290.0, 310.0, fits.FIT_ACCURACY), limits(fluid)) == found
    assert cache_folder.unsealed(b"") is None

import gc
from pathlib import Path

import pytest
from hypothesis import settings

# The first example of a test assembles and compiles its scene, so a deadline per example would measure that. Few
# examples for each run of the tests: they are others the next time.
settings.register_profile("surfacechem", deadline=None, max_examples=10)
settings.load_profile("surfacechem")

# What tests share is kept to the end: at the usual rate a worker looks through all of it again and again.
gc.set_threshold(100_000, 20, 50)

EVERY_CASE = (
    *("test_zoo", "test_cases", "test_dataset", "test_scene_view", "test_case_files"),
    *("test_vectors", "test_edges", "test_typeset", "test_refinement"),
)
"""Files of tests that ask for many shipped cases or their runs, which case_runs.py keeps for all in a worker."""


LONG = (
    *EVERY_CASE,
    *("test_docs", "test_random_scenes", "test_jump_heat", "test_rate_and_state", "test_cli_process", "test_streaming"),
    *("test_reactor", "test_reactor_jumps", "test_conduction", "test_plane", "test_stability", "test_precision"),
)
"""Files that take longest: they go first, so that no worker is left alone with one of them at the end."""


def pytest_ignore_collect(collection_path, config):
    """Of files that are around the core as a whole nothing is imported where none of them is asked for."""
    if "not around" not in config.option.markexpr or not collection_path.name.startswith("test_"):
        return None
    return "\npytestmark = pytest.mark.around\n" in collection_path.read_text(encoding="utf-8") or None


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: LONG.index(item.path.stem) if item.path.stem in LONG else len(LONG))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With ``--dist loadfile``, files that run every case go to the same worker, and files in the order of above."""
    from xdist.scheduler import LoadFileScheduling

    class LoadSharedRuns(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return "every case" if Path(file).stem in EVERY_CASE else file

    if config.getvalue("dist") != "loadfile":
        return None
    config.option.loadscopereorder = False
    return LoadSharedRuns(config, log)

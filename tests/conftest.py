import pytest
from hypothesis import settings

# The first example of a test assembles and compiles its scene, so a deadline per example would measure that.
settings.register_profile("surfacechem", deadline=None)
settings.load_profile("surfacechem")

EVERY_CASE = ("test_cases", "test_dataset", "test_golden")
"""Files of tests that ask for a run of every shipped case."""


def pytest_collection_modifyitems(config, items):
    """With `--dist loadgroup` tests that share what they assemble, compile and run stay with one worker: those of a
    file, and those of every case.
    """
    if config.pluginmanager.hasplugin("xdist"):
        for item in items:
            group = "every case" if item.path.stem in EVERY_CASE else str(item.path)
            item.add_marker(pytest.mark.xdist_group(group))

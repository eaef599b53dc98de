from hypothesis import settings

# The first example of a test assembles and compiles its scene, so a deadline per example would measure that.
settings.register_profile("surfacechem", deadline=None)
settings.load_profile("surfacechem")

"""A mechanism by itself: equilibria, rates over temperature and force, cycles."""

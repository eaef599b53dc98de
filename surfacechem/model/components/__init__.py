"""Components of a scene: temperatures, bonds, gaps, heat paths, loads."""

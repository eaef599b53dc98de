"""Components of a scene: temperatures, bonds, gaps, motion along the surfaces, heat paths, loads."""

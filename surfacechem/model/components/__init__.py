"""What a scene is made of: temperatures, bonds, gaps, heat paths, loads."""

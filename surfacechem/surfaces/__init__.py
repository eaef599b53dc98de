"""Two curved surfaces: their nearest places, the interaction of their points, and the resultant force."""

"""Two curved surfaces: their nearest points, the interaction of their points, and the resultant force."""

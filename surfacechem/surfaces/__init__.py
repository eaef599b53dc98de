"""Two curved surfaces: where they are nearest, what their points do to each other, and the force that follows."""

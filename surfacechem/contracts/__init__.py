"""What laws state, what they may read, and the bodies, cells and media that they speak of."""

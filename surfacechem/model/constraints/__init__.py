"""What a scene must not pass: contact, bounds of bonding, limits of traction, folds."""

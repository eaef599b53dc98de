"""Many runs at once: eight cases in the places of a vector, each with its own time, step and end."""

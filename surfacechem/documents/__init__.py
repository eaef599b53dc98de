"""YAML documents whose values know their places, and the files that come with the package."""

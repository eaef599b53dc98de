"""YAML documents whose values know their place, and the files that come with the package."""

"""``python -m surfacechem``: the command line."""

from surfacechem.cli import console

if __name__ == "__main__":
    console()

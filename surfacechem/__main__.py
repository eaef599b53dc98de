"""``python -m surfacechem``: the command line."""

from surfacechem.cli.main import app

if __name__ == "__main__":
    app(prog_name="surfacechem")

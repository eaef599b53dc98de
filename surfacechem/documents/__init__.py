"""YAML documents whose values know their places, and the folders of the shipped cases and mechanisms.

The folders are those of the installed package, else in the checkout.
"""

from pathlib import Path


def cases() -> Path:
    """Return the folder of the case files.

    >>> cases().name
    'cases'
    """
    return _folder("cases")


def mechanisms() -> Path:
    """Return the folder of the Cantera surface mechanisms.

    >>> mechanisms().name
    'mechanisms'
    """
    return _folder("mechanisms")


def _folder(name: str) -> Path:
    package = Path(__file__).parents[1]
    packaged = package / "_data" / name
    return packaged if packaged.is_dir() else package.parent / name

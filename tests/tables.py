"""The exact tables: 30 digits, from an independent calculation."""

import json
from functools import cache
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent / "references"


@cache
def table(name: str) -> dict:
    return json.loads((FOLDER / f"{name}.json").read_text())


def parameters(name: str) -> dict[str, float]:
    return {key: float(value) for key, value in table(name)["parameters"].items()}


def rows(name: str) -> list[dict]:
    """Rows by column; words stay words."""
    return [dict(zip(table(name)["columns"], map(_entry, row), strict=True)) for row in table(name)["rows"]]


def columns(name: str) -> dict[str, np.ndarray]:
    return {key: np.array([row[key] for row in rows(name)]) for key in table(name)["columns"]}


def read(name: str) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Parameters and columns of a table."""
    return parameters(name), columns(name)


def expected(name: str) -> dict[str, float]:
    return {key: float(value) for key, value in table(name)["expect"].items()}


def _entry(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text

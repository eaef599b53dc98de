"""A key is declared once: reader, strict checks, default and JSON Schema follow."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import surfacechem

TEMPERATURE = (
    '    temperature: Load = key(Prescribed("K", above_zero=True), "temperature of the surroundings", REQUIRED)'
)
HUMIDITY = '    humidity: float = quantity("1", "relative humidity", 0.5, at_least=0, at_most=1)'
USE = """
from surfacechem.documents.document import parse
from surfacechem.errors import InputError
from surfacechem.format.reader import read_document
from surfacechem.format.schema import schema
text = "bodies: {a: {temperature: T}, b: {temperature: T}}\\nsurroundings: {temperature: 300, HERE}\\nrun: {until: 1}"
for here in ("humidity: 40 percent", "humdity: 1"):
    try:
        print(read_document(parse(text.replace("HERE", here), "a.yaml"))[0].surroundings.humidity)
    except InputError as error:
        print(error)
print(schema()["properties"]["surroundings"]["properties"]["humidity"]["default"])
"""


def test_a_new_key_is_added_in_one_place(tmp_path):
    shutil.copytree(Path(surfacechem.__file__).parent, tmp_path / "surfacechem")
    sections = tmp_path / "surfacechem" / "format" / "sections.py"
    declared = sections.read_text(encoding="utf-8")
    sections.write_text(declared.replace(TEMPERATURE, f"{TEMPERATURE}\n{HUMIDITY}"), encoding="utf-8")
    there = {"cwd": tmp_path, "env": {**os.environ, "PYTHONPATH": str(tmp_path)}}
    done = subprocess.run([sys.executable, "-c", USE], **there, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "0.4",
        "a.yaml:2: surroundings: unknown key 'humdity'. Did you mean 'humidity'? Known: humidity, temperature.",
        "0.5",
    ]

"""The page about a run: all in one file, within a phone's width in a real browser, and without code that it carries."""

import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from sampling import every

import surfacechem
from surfacechem.compile.typeset import equations
from surfacechem.errors import InputError
from surfacechem.format.plans import recorded_plan
from surfacechem.results import spatial
from surfacechem.studies import run_report
from surfacechem.studies.report import typeset_equation

pytestmark = pytest.mark.around

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PHONE = 390
LARGEST = 1_000_000
MEASURE = """<!DOCTYPE html><iframe id=f style="width:%dpx;height:900px;border:0"></iframe><pre id=o></pre><script>
const f = document.getElementById("f");
f.onload = () => {
  const beyond = [];
  for (const e of f.contentDocument.body.querySelectorAll("*")) {
    const inner = e.closest("table,pre,.equation,svg");  // what scrolls or scales by itself
    if ((!inner || inner === e) && e.getBoundingClientRect().right > %d + 0.5) beyond.push(e.tagName);
  }
  const d = f.contentDocument.documentElement;
  document.getElementById("o").textContent = JSON.stringify([d.scrollWidth, d.scrollHeight, beyond]);
};
f.srcdoc = %s;
</script>"""
PARTS = ["What happened", "The scene", "Laws", "Equations", "Balances", "How to run it again", "Machine and versions"]


@pytest.fixture(scope="module", params=every(2, ["stick-slip", "force-spectroscopy"]))
def report(request, tmp_path_factory):
    simulation = surfacechem.load(request.param)
    swept = simulation.case.sweep is not None
    solution = simulation.sweep({"interface.bonding.bell.k_off": [1, 2]}) if swept else simulation.run()
    return run_report.write(solution.dataset, tmp_path_factory.mktemp("report") / "report.html")


def test_a_report_is_one_file_without_scripts_or_network(report):
    text = report.read_text(encoding="utf-8")
    assert len(text.encode()) < LARGEST
    assert not re.search(r"<script|<link|@import|src=|href=[\"']http", text)
    assert [part for part in PARTS if f"<h2>{part}</h2>" not in text] == []
    assert text.count("<svg") == 3
    assert text.count('<figure class="wide">') == text.count('<figure class="slim">') == 1  # the second for phones
    names = re.findall(r'\bid="([^"]+)"', text)
    assert len(names) == len(set(names))


@pytest.mark.skipif(BROWSER is None, reason="needs Chromium")
def test_nothing_overflows_on_a_phone(report, tmp_path):
    page = tmp_path / "measure.html"
    source = json.dumps(report.read_text(encoding="utf-8")).replace("</", "<\\/")
    page.write_text(MEASURE % (PHONE, PHONE, source), encoding="utf-8")
    browser = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    waiting = [*browser, "--virtual-time-budget=5000", "--dump-dom", str(page)]
    done = subprocess.run(waiting, capture_output=True, text=True, check=True, timeout=120)
    width, height, beyond = json.loads(re.search(r'<pre id="o">(.*?)</pre>', done.stdout)[1])
    assert width <= PHONE
    assert height > 900
    assert beyond == []


@pytest.mark.parametrize("name", ["compliant-debonding", "snap-in"])
def test_long_equations_fit_into_the_lines_of_a_phone(name):
    """In its smallest letters, of 8 px, a piece between which a line may break has 44 em."""
    lines = equations(surfacechem.load(name).case.system())[0]
    for line in lines:
        widths = re.findall(r"--w:(\d+)", typeset_equation(line))
        assert max(map(int, widths)) <= 44, line.text
        text = " ".join([line.left, *line.pieces])
        assert text.count("(") == text.count(")")


def test_a_report_of_events_lists_them_with_verdicts(tmp_path):
    dataset = surfacechem.run("stick-slip").dataset
    text = run_report.page(dataset).text()
    assert text.count("slip forward") == 6
    assert "Error against run time" in text
    assert run_report.page(dataset).command == "surfacechem run case.yaml"
    assert not run_report.page(dataset.assign_attrs(case="")).command
    with pytest.raises(InputError, match="this is no dataset of a run or of a sweep"):
        run_report.page(dataset.drop_attrs())
    dataset[["time"]].drop_attrs().to_netcdf(tmp_path / "bare.nc")
    with pytest.raises(InputError, match=r"bare.nc: this is no dataset of a run or of a sweep"):
        run_report.page(tmp_path / "bare.nc")


def test_rates_that_cantera_gives_are_no_numbers_of_the_scene():
    page = run_report.page(surfacechem.run("temperature-programmed-desorption").dataset)
    (numbers,) = (table.rows for part in page.sections for table in part.tables if table.caption == "Numbers")
    assert numbers
    assert not [row for row in numbers if row[3].startswith("net rate, evaluated by Cantera")]


def numbers_of(page):
    (rows,) = (table.rows for part in page.sections for table in part.tables if table.caption == "Numbers")
    return {row[3].partition("(")[2].partition(")")[0]: row[1:] for row in rows}


@pytest.mark.parametrize("written", [False, True])
def test_numbers_are_those_of_the_run_and_say_where_they_are_not_those_of_the_case(written, tmp_path):
    solution = surfacechem.load("sliding-dry").run({"interface.friction.coulomb.mu": 0.9, "initial.T": 280})
    page = run_report.page(solution.write(tmp_path / "d.nc") if written else solution.dataset)
    value, unit, meaning = numbers_of(page)["interface.friction.coulomb.mu"]
    assert (value, unit, meaning.endswith("; 0.3 in the case")) == ("0.9", "1", True)
    assert numbers_of(page)["initial.T"][:2] == ("280", "K")
    told = "changed in Python: interface.friction.coulomb.mu = 0.9, initial.T = 280 K."
    assert [part.title for part in page.sections if told in " ".join(part.paragraphs)] == [
        "What happened",
        "How to run it again",
    ]


def test_a_temperature_at_the_start_that_cells_share_has_the_name_of_the_surface():
    case = surfacechem.load("epoxy-cure-thick").case
    symbols = equations(replace(case, scene=spatial.few(case.scene)).system())[1]
    assert [symbols[path] for path in ("initial.T", "initial.T_2")] == ["T(0)", "T_2(0)"]


def test_a_temperature_that_was_changed_is_that_of_the_drawing():
    page = run_report.page(surfacechem.load("reservoir-exchange").run({"bodies.reservoir.temperature": 350}).dataset)
    (drawing,) = (draw() for part in page.sections for draw in part.drawings)
    assert "350 K, given" in [text.get_text().split("\n")[0] for text in drawing.axes[0].texts]


def test_the_report_of_a_sweep_made_in_python_says_how_python_makes_it_again(tmp_path, monkeypatch):
    names = {"load": surfacechem.load, "recorded_plan": recorded_plan}
    dataset = surfacechem.load("exothermic").sweep({"initial.phi": [0.1, 0.2]}, changes={"initial.T": 290.0}).dataset
    assert [numbers_of(run_report.page(dataset))[path][0] for path in ("initial.phi", "initial.T")] == ["swept", "290"]
    monkeypatch.chdir(tmp_path)
    Path("case.yaml").write_text(dataset.attrs["case"], encoding="utf-8")
    (told,) = re.findall(r"case below: (.*); recorded_plan", html.unescape(run_report.page(dataset).html()))
    assert eval(told, names).dataset.phi.equals(dataset.phi)

"""What a terminal shows, and that files and pipes get plain text."""

import logging
import re
from io import StringIO

import pytest

from surfacechem.cli import terminal
from surfacechem.runs.listing import Sheet
from surfacechem.studies.report import Page, PageSection, PageTable

pytestmark = pytest.mark.around

SHEET = Sheet("Two bodies", [("failed", "after " + "many steps " * 9)], {"States": [("T", "[K]"), ("phi", "[1]")]})


class Terminal(StringIO):
    def isatty(self):
        return True


def on_terminal(monkeypatch):
    """Standard output and error as terminals, of 60 columns; not in a fixture, as pytest sets them for each phase."""
    found = {name: Terminal() for name in ("stdout", "stderr")}
    for name, stream in found.items():
        monkeypatch.setattr(f"sys.{name}", stream)
    for name, value in {"TERM": "xterm", "COLUMNS": "60"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NO_COLOR", raising=False)
    return found


def test_a_terminal_gets_colours_and_texts_that_fit_it(monkeypatch):
    streams = on_terminal(monkeypatch)
    terminal.show(SHEET)
    lines = streams["stdout"].getvalue().splitlines()
    assert lines[0] == "\x1b[1mTwo bodies\x1b[0m"
    assert "\x1b[31mfailed\x1b[0m" in lines[1]
    assert lines[2].startswith(10 * " ")  # the text goes on beside its label
    assert [line.split("\x1b[0m")[-1].strip() for line in lines[-2:]] == ["[K]", "[1]"]


def test_a_pipe_gets_plain_text(monkeypatch):
    streams = on_terminal(monkeypatch)
    monkeypatch.setenv("TERM", "dumb")
    terminal.show(SHEET, SHEET)
    assert streams["stdout"].getvalue() == f"{SHEET}\n\n{SHEET}\n"
    assert "\x1b" not in str(SHEET)


def test_a_bar_shows_what_is_logged_after_a_while(monkeypatch):
    streams = on_terminal(monkeypatch)
    log = logging.getLogger("surfacechem.runs.sweeps")
    for patience, talk, shown in ((1e9, None, False), (0.0, False, False), (0.0, None, True)):
        monkeypatch.setattr(terminal, "BAR_DELAY", patience)
        with terminal.progress_bar(talk) as bar:
            log.info("runs", extra={"done": 3, "total": 12})
            bar.tick()
        assert ("3/12" in streams["stderr"].getvalue()) is shown
    with terminal.progress_bar(talk=True):
        log.info("runs", extra={"done": 4, "total": 12})
    assert streams["stderr"].getvalue().endswith("s  runs (4/12)\n")
    assert logging.getLogger("surfacechem").handlers == []


def test_a_log_gets_a_line_now_and_then(monkeypatch, capsys):
    """Where a sweep takes minutes and nothing is a terminal."""
    log = logging.getLogger("surfacechem.runs.sweeps")
    monkeypatch.setattr(terminal, "LINE_EVERY", 0.0)
    for talk in (None, False):
        with terminal.progress_bar(talk) as bar:
            bar.due = -1.0  # of the past
            log.info("runs", extra={"done": 3, "total": 12})
            bar.tick()
    assert re.fullmatch(r" +0\.\d\d s  runs \(3/12\)\n", capsys.readouterr().err)


def test_a_study_has_tables_in_which_failures_stand_out(monkeypatch):
    streams = on_terminal(monkeypatch)
    table = PageTable(("solver", "verdict"), [("radau", "right"), ("other", "wrong " * 12)], "Verdicts", marked=[1])
    page = Page("A study", "surfacechem stability", [PageSection("Stiff", ["Words."], [table])], ["nothing to compare"])
    terminal.show_page(page)
    shown = streams["stdout"].getvalue()
    red = [line for line in shown.splitlines() if "\x1b[31m" in line]
    assert ("other" in red[0], len(red), "radau" in "".join(red)) == (True, 2, False)
    assert max(len(re.sub(r"\x1b\[[\d;]*m", "", line)) for line in shown.splitlines()) <= 60
    monkeypatch.setenv("TERM", "dumb")
    terminal.show_page(page)
    assert streams["stdout"].getvalue().endswith(f"{page.text()}\n")

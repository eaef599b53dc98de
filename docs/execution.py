"""Notebooks run in the process that builds the pages: a kernel for each of them would import everything anew."""

import gc
import io
from contextlib import redirect_stdout
from functools import cache
from types import SimpleNamespace
from typing import Any

import jupytext
import matplotlib
from IPython.core.displaypub import DisplayPublisher
from IPython.core.interactiveshell import InteractiveShell
from mkdocs_jupyter import nbconvert2
from nbformat.v4 import new_output
from traitlets.config import Config


def install() -> None:
    """Let the plugin that makes pages of notebooks read them with their outputs."""
    nbconvert2.jupytext = SimpleNamespace(read=lambda path: executed(str(path))[0], writes=jupytext.writes)


class Publisher(DisplayPublisher):
    """Keeps what a cell displays."""

    def publish(self, data: Any, metadata: Any = None, **_: Any) -> None:
        """Keep one thing that is displayed."""
        self.shell.shown.append(new_output("display_data", data, metadata=metadata or {}))


class Shell(InteractiveShell):
    """A shell that keeps what a cell displays, and its value, instead of printing them."""

    shown: list[Any]

    def enable_gui(self, gui: Any = None) -> None:
        """Have no windows."""

    def result(self, value: Any) -> None:
        """Keep the value of a cell."""
        if value is not None:
            data, metadata = self.display_formatter.format(value)
            count = self.execution_count
            self.shown.append(new_output("execute_result", data, metadata=metadata, execution_count=count))

    def run(self, cell: Any) -> None:
        """Execute a cell, with an error if it has one, and put its outputs into it."""
        self.shown, cell.execution_count = [], self.execution_count
        with redirect_stdout(io.StringIO()) as printed:
            self.run_cell(cell.source, store_history=True).raise_error()
        streams = [new_output("stream", name="stdout", text=printed.getvalue())] if printed.getvalue() else []
        cell.outputs = streams + self.shown


@cache
def executed(path: str) -> tuple[Any, dict[str, Any]]:
    """A notebook with its outputs, and the names that it has defined."""
    shell = Shell.instance(display_pub_class=Publisher, config=Config(HistoryManager={"enabled": False}))
    shell.display_trap.hook = shell.result
    shell.reset(new_session=True)  # which collects garbage
    gc.freeze()  # what is there is not looked through for the next notebook
    shell.enable_matplotlib("inline")
    notebook = jupytext.read(path)
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        for cell in notebook.cells:
            if cell.cell_type == "code":
                shell.run(cell)
    return notebook, dict(shell.user_ns)

"""The notebook runs from its first cell to its last, and holds its outputs."""

from pathlib import Path

import nbclient
import nbformat

NOTEBOOK = Path(__file__).resolve().parents[1] / "examples" / "tour.ipynb"


def outputs(notebook):
    """The kinds of outputs of each cell of code, such as a picture."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return [sorted({kind for output in cell.outputs for kind in output.get("data", {"text": 0})}) for cell in cells]


def test_the_notebook_runs_and_its_pictures_are_stored():
    stored = nbformat.read(NOTEBOOK, as_version=4)
    assert NOTEBOOK.stat().st_size < 1_000_000
    fresh = nbformat.read(NOTEBOOK, as_version=4)
    nbclient.NotebookClient(fresh, timeout=600, resources={"metadata": {"path": str(NOTEBOOK.parent)}}).execute()
    assert outputs(fresh) == outputs(stored)
    assert sum("image/png" in kinds for kinds in outputs(stored)) >= 3

"""The code of each notebook runs from top to bottom, twice in a row, and its outputs are stored."""
import contextlib
import io
import json
import pathlib

import pytest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def read_cells(notebook):
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_twice(notebook, tmp_path, monkeypatch):
    if "matplotlib" in notebook.read_text(encoding="utf-8"):
        pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names = {}
    for _ in range(2):
        for number, cell in enumerate(read_cells(notebook)):
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile("".join(cell["source"]), f"{notebook.name} cell {number}", "exec"), names)
            stored = "".join("".join(one["text"]) for one in cell["outputs"] if one.get("name") == "stdout")
            assert len(stored.splitlines()) == len(printed.getvalue().splitlines()), "the stored outputs are old"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_is_stored_with_its_outputs(notebook):
    cells = read_cells(notebook)
    assert all(cell["execution_count"] for cell in cells) and all(cell["outputs"] for cell in cells[1:])
    kinds = [kind for cell in cells for one in cell["outputs"] for kind in one.get("data", {})]
    shown = sum("".join(cell["source"]).count("plt.show()") for cell in cells)
    assert kinds.count("image/png") == shown
    assert "/tmp" not in json.dumps([cell["outputs"] for cell in cells]), "names a folder of one machine"

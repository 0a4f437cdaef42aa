"""Executes every notebook in a folder, each in a folder of its own: `notebooks.py FOLDER`."""

import pathlib
import sys
import tempfile
import time

import nbformat
from nbclient import NotebookClient

paths = sorted(pathlib.Path(sys.argv[1]).glob("*.ipynb"))
assert len(paths) >= 5, paths
for path in paths:
    start = time.monotonic()
    notebook = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), f"{path.name}: outputs are not kept; clear them"
    with tempfile.TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=300, resources={"metadata": {"path": folder}}).execute()
    figures = sum(
        "image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])
    )
    print(f"{path.name}: {figures} figures, {time.monotonic() - start:.0f} s")

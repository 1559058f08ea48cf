"""The example notebook, run as it is read."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[2] / "examples" / "frames.ipynb"


def test_the_notebook_runs(tmp_path):
    pytest.importorskip("pyvista", reason="pyvista is large: pip install pyvista")
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    code = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    environment = {**os.environ, "PYVISTA_OFF_SCREEN": "true"}
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=600, env=environment
    )
    assert result.returncode == 0, result.stderr[-2000:]
    assert "the front is at" in result.stdout
    assert (tmp_path / "out" / "dam-break-pyvista.png").stat().st_size > 10_000

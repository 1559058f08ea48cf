"""Every example runs as a user would run it."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("[0-9][0-9]_*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path, tmp_path):
    result = subprocess.run([sys.executable, str(path)], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip()
    pictures = [p for p in tmp_path.rglob("*") if p.suffix in (".png", ".mp4", ".npz", ".toml")]
    assert pictures
    assert all(p.stat().st_size > 0 for p in pictures)


def test_there_are_examples():
    assert len(EXAMPLES) >= 4
    assert [path.name[:2] for path in EXAMPLES] == [
        f"{number:02d}" for number in range(len(EXAMPLES))
    ]  # none is skipped

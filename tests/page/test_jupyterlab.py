"""`wt.show` in JupyterLab with a browser: played, saved, opened again without a kernel."""

import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from benchmarks.browser.chromium import Browser, executable

pytest.importorskip("jupyterlab", reason="JupyterLab is large: pip install jupyterlab")
pytest.importorskip("anywidget", reason="wt.show needs anywidget: pip install 'wavetank[notebook]'")
pytestmark = pytest.mark.skipif(executable() is None, reason="there is no Chromium here: apt-get install chromium")

CELLS = (
    """import wavetank as wt
sim = wt.Simulation(wt.Scene(title="Pool", spacing=0.015, tank=wt.Tank(size=(0.9, 0.6)),
                             fluids=[wt.Block(lower=(0, 0), upper=(0.45, 0.3))]))
wt.show(sim)""",
    "sim",
)
RUN = "notebook:run-cell-and-select-next"
SAID = "(document.querySelector('.wavetank-live .said')?.textContent ?? '')"
IS_IDLE = "document.querySelector('.jp-Notebook-ExecutionIndicator')?.dataset.status === 'idle'"


@pytest.fixture
def lab(tmp_path):
    """JupyterLab in a folder: its address, with a function that asks its server for something."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    home = {name: str(tmp_path / "home") for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "IPYTHONDIR")}
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "jupyterlab",
                "--no-browser",
                f"--port={port}",
                "--ServerApp.port_retries=0",
                "--IdentityProvider.token=t",
                "--allow-root",
                f"--ServerApp.root_dir={tmp_path}",
            ],
            cwd=tmp_path,
            stdout=log,
            stderr=log,
            env={**os.environ, **home},
        )
    address = f"http://127.0.0.1:{port}"

    def ask(path, method="GET"):
        with urllib.request.urlopen(urllib.request.Request(f"{address}{path}?token=t", method=method)) as answer:
            text = answer.read()
        return json.loads(text) if text else None

    end = time.monotonic() + 60
    while True:
        try:
            ask("/api/status")
            break
        except OSError:
            assert time.monotonic() < end, (tmp_path / "log").read_text()[-2000:]
            time.sleep(0.2)
    yield address, ask
    for running in ask("/api/sessions"):
        ask(f"/api/sessions/{running['id']}", "DELETE")
    process.kill()  # asked politely it takes its time
    process.wait(30)


def push(browser, command, came_true):
    """Push a button of the notebook's toolbar until it does something: JupyterLab hears late after it has begun."""
    button = f".jp-NotebookPanel-toolbar [data-command='{command}']"
    for _ in range(10):
        browser.click(button)
        end = time.monotonic() + 3
        while time.monotonic() < end:
            if browser.run(came_true):
                return
            time.sleep(0.1)
    raise AssertionError(f"{command} does nothing")


def test_played_saved_and_opened_again_without_a_kernel(lab, tmp_path):
    address, ask = lab
    path = tmp_path / "pool.ipynb"
    empty = {"cell_type": "code", "metadata": {}, "outputs": [], "execution_count": None}
    cells = [{**empty, "source": cell} for cell in CELLS]
    about = {"kernelspec": {"name": "python3", "printable": "Python 3"}}
    path.write_text(json.dumps({"cells": cells, "metadata": about, "nbformat": 4, "nbformat_minor": 4}))
    browser = Browser(tmp_path / "first", 1280, 1100)
    try:
        browser.open(f"{address}/lab/tree/pool.ipynb?token=t&reset")
        browser.wait_for(IS_IDLE, 120)
        push(browser, RUN, "document.querySelector('.jp-InputPrompt').textContent !== '[ ]:'")
        browser.wait_for(f"{SAID}.includes('particles')", 90)
        browser.wait_for(f"parseFloat({SAID}.slice(4)) > 5", 90)  # the first picture that is kept is of t = 4 s or so
        # The picture that is kept is out of sight while there is a live one.
        posters = "[...document.querySelectorAll('.jp-OutputArea-output img')].filter((image) => image.offsetParent)"
        assert browser.run(f"{posters}.length") == 0
        # Hands, keys: the notebook's own shortcuts stay out of it.
        count = "parseInt(" + SAID + ".match(/· ([\\d,]+) p/)[1].replaceAll(',', ''))"
        before = browser.run(count)
        browser.click(".wavetank-live [data-tool=pour]")
        x, y = browser.center(".wavetank-live .picture", 0.7, 0.4)
        browser.mouse("mousePressed", x, y)
        browser.wait_for(f"{count} > {before}", 30)
        browser.mouse("mouseReleased", x, y)
        # What the page knows, it knows: the ring on the water, the pace to expect of a detail, undo.
        browser.mouse("mouseMoved", x + 5, y + 20)
        browser.wait_for("document.querySelector('.wavetank-live .aim .ring').getAttribute('points')?.length > 100")
        browser.run("document.querySelector('.wavetank-live details').open = true")
        browser.wait_for("document.querySelector('.wavetank-live .fine output')?.textContent.includes('expected')", 20)
        undo = "document.querySelector('.wavetank-live button[aria-label=Undo]')"
        assert browser.run(f"{undo}.hidden")
        browser.click(".wavetank-live button[aria-label=Restart]")
        browser.wait_for(f"!{undo}.hidden", 20)
        browser.wait_for(f"{count} < {before + 1}", 20)
        if folder := os.environ.get("WAVETANK_PICTURES"):  # to look at
            browser.picture(Path(folder) / "jupyterlab.png")
        browser.click(".wavetank-live button[aria-label=Undo]")
        browser.wait_for(f"{count} > {before}", 20)
        browser.run("document.querySelector('.wavetank-live details').open = false")
        browser.click(".wavetank-live .picture")
        browser.key(" ")
        browser.wait_for(
            "document.querySelector('.wavetank-live .bar button:nth-child(2)').title.startsWith('Play')", 30
        )
        assert browser.run("document.querySelectorAll('.jp-Cell').length") == 2
        time.sleep(1.0)
        said = browser.run(SAID)
        is_it = "(cell) => cell.querySelector('.cm-content')?.textContent === 'sim'"
        second = f"[...document.querySelectorAll('.jp-CodeCell')].find({is_it})"
        browser.run(f"{second}.id = 'second'; {second}.scrollIntoView()")
        browser.click("#second .jp-InputPrompt")
        told = "parseFloat(document.querySelector('#second').textContent.split('t = ')[1])"
        push(browser, RUN, f"Math.abs({told} - {float(said[4:].split(' s')[0])}) < 0.006")
        push(browser, "docmanager:save", "document.querySelector('.jp-mod-dirty') === null")
        end = time.monotonic() + 30
        while "image/png" not in path.read_text() and time.monotonic() < end:
            time.sleep(0.2)
        assert browser.complaints() == []
    finally:
        browser.close()

    # What the cells hold is what was seen, at the very time; no address is in the file.
    saved = json.loads(path.read_text())
    text = "".join(saved["cells"][1]["outputs"][0]["data"]["text/plain"])
    seconds = float(text.split("t = ")[1].split(" s")[0])
    assert seconds > 5 and f"t = {seconds:.2f} s" in said
    assert "127.0.0.1" not in path.read_text() and "token" not in path.read_text()
    poster = saved["cells"][0]["outputs"][0]["data"]
    assert f"t = {seconds:.3f} s" in "".join(poster["text/plain"])  # the last picture, not the first

    for running in ask("/api/sessions"):
        ask(f"/api/sessions/{running['id']}", "DELETE")
    browser = Browser(tmp_path / "second", 1280, 900)
    try:
        browser.open(f"{address}/lab/tree/pool.ipynb?token=t&reset&kernel=none")
        image = "document.querySelector('.jp-OutputArea-output img')"
        browser.wait_for(f"{image}?.naturalWidth > 100 && {image}.offsetParent !== null", 60)
        assert browser.run("document.querySelector('.wavetank-live')") is None
    finally:
        browser.close()

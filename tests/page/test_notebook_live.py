"""`wt.show` in a real notebook: a kernel runs it, and what a browser would send goes over the kernel's channel."""

import base64
import io
import json
import os
import re
import sys
import time

import pytest

import wavetank as wt

nbformat = pytest.importorskip("nbformat", reason="a notebook: pip install nbformat nbclient ipykernel anywidget")
nbclient = pytest.importorskip("nbclient", reason="a notebook: pip install nbformat nbclient ipykernel anywidget")
pytest.importorskip("ipykernel", reason="a notebook needs a kernel: pip install ipykernel")
pytest.importorskip("anywidget", reason="wt.show needs anywidget: pip install 'wavetank[notebook]'")

WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"
SIM = """
import wavetank as wt
scene = wt.Scene(title="Pool", spacing=0.03, tank=wt.Tank(size=(0.9, 0.6)),
                 fluids=[wt.Block(lower=(0, 0), upper=(0.45, 0.3))])
sim = wt.Simulation(scene)
sim.advance(0.3)
view = wt.show(sim)
view
"""


class Notebook:
    """A kernel, and what a notebook's page does: cells, and messages of the widget."""

    def __init__(self, folder) -> None:
        from jupyter_client.kernelspec import KernelSpec
        from jupyter_client.manager import KernelManager

        self.manager = KernelManager()
        self.manager._kernel_spec = KernelSpec(
            argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"], language="python"
        )
        self.manager.start_kernel(cwd=str(folder), env={**os.environ, "JUPYTER_PLATFORM_DIRS": "1"})
        self.client = self.manager.blocking_client()
        self.client.start_channels()
        self.client.wait_for_ready(timeout=120)
        self.messages: list[dict] = []
        self.model = ""

    def close(self) -> None:
        self.client.stop_channels()
        self.manager.shutdown_kernel(now=True)

    def listen(self, until, seconds=60.0):
        """Read what the kernel says until it says something that `until` accepts."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                message = self.client.get_iopub_msg(timeout=1.0)
            except Exception:
                continue
            self.messages.append(message)
            content = message["content"]
            if message["msg_type"] == "comm_open" and "_esm" in content["data"]["state"]:
                self.model, self.state = content["comm_id"], content["data"]["state"]
            if message["msg_type"] == "comm_msg" and content["data"].get("content", {}).get("type") == "picture":
                self.say(do="ack")
            found = until(message)
            if found:
                return found
        raise AssertionError("the kernel did not say it")

    def run(self, code: str) -> str:
        """Run a cell to its end and return what it printed."""
        asked, printed = self.client.execute(code), []

        def ended(message):
            if message["parent_header"].get("msg_id") != asked:
                return False
            content = message["content"]
            assert message["msg_type"] != "error", "\n".join(content.get("traceback", []))
            if message["msg_type"] == "stream":
                printed.append(content["text"])
            if message["msg_type"] == "execute_result":
                printed.append(content["data"]["text/plain"])
            return message["msg_type"] == "status" and content["execution_state"] == "idle"

        self.listen(ended)
        return "".join(printed).strip()

    def say(self, **content) -> None:
        """Send a message as the widget in the page does."""
        data = {"method": "custom", "content": content}
        message = self.client.session.msg("comm_msg", {"comm_id": self.model, "data": data})
        self.client.shell_channel.send(message)

    def custom(self, kind: str, where=lambda content: True):
        """Wait for a message of the kernel to the widget."""

        def is_it(message):
            content = message["content"].get("data", {})
            content = content.get("content", {}) if isinstance(content, dict) else {}
            is_ours = message["msg_type"] == "comm_msg" and content.get("type") == kind
            return (content, message["buffers"]) if is_ours and where(content) else None

        return self.listen(is_it)

    def value(self, expression: str):
        return json.loads(self.run(f"import json; print(json.dumps({expression}))"))


@pytest.fixture(scope="module")
def notebook(tmp_path_factory):
    world = Notebook(tmp_path_factory.mktemp("notebook"))
    yield world
    world.close()


@pytest.fixture(scope="module")
def shown(notebook):
    """A notebook that shows a simulation, with its widget open in a page."""
    notebook.run(SIM)
    notebook.say(do="open", view="one")
    hello, _ = notebook.custom("hello")
    assert hello["title"] == "Pool" and {"pour", "push"} <= {tool["name"] for tool in hello["tools"]}
    return notebook


def test_nothing_runs_before_someone_looks(notebook):
    notebook.run(SIM.replace("sim", "unseen").replace("view", "unseen_view"))
    first = notebook.value("unseen.time")
    time.sleep(1.0)
    assert notebook.value("unseen.time") == first == pytest.approx(0.3)
    notebook.run("unseen_view.stop()")


def test_the_simulation_of_the_cells_is_what_is_seen(shown):
    """Played, its time goes on; the status that the page shows is its time; paused, both stand."""
    shown.say(do="size", width=320, height=180)
    _, buffers = shown.custom("picture")
    assert bytes(buffers[0][:2]) == b"\xff\xd8"
    shown.custom("status", lambda status: status["time"] > 0.6)
    assert shown.value("sim.time") > 0.6
    shown.say(do="pause", on=True)
    status, _ = shown.custom("status", lambda status: status["paused"])
    assert shown.value("[sim.time, view.sim is sim]") == [pytest.approx(status["time"]), True]
    # What a cell does is seen, too.
    shown.run("sim.advance(0.25)")
    later, _ = shown.custom("status", lambda now: now["time"] > status["time"] + 0.2)
    assert later["time"] == pytest.approx(status["time"] + 0.25, abs=0.02)
    pictures = [m for m in shown.messages if m["content"].get("data", {}).get("content", {}).get("type") == "picture"]
    from PIL import Image

    width, height = Image.open(io.BytesIO(pictures[-1]["buffers"][0])).size
    assert 120 <= width <= 320 and 60 <= height <= 180  # as large as asked, or less where the machine is slow


def test_hands_and_parameters_from_the_page_change_that_very_object(shown):
    before = shown.value("sim.count")
    shown.say(do="pause", on=False)
    shown.say(do="point-begin", x=0.7, y=0.3, tool="pour", options={})
    shown.say(do="point-move", x=0.72, y=0.3)
    shown.custom("status", lambda status: status["count"] > before)
    shown.say(do="point-end")
    shown.say(do="set", name="viscosity", value=0.2)
    shown.custom("status", lambda status: status.get("world", {}).get("values", {}).get("viscosity") == 0.2)
    count, viscosity, hands = shown.value("[sim.count, sim.viscosity, len(view.session.hands)]")
    assert count > before and viscosity == 0.2 and hands == 0


def test_a_reset_keeps_the_object_and_its_forces(shown):
    from_before = shown.value("id(sim)")
    shown.run("from wavetank.scene.forces.wind import Wind; sim.forces.append(Wind(velocity=(1, 0)))")
    shown.say(do="pause", on=True)
    shown.say(do="reset")
    shown.custom("status", lambda status: status["time"] == 0.0)
    ours = shown.value("[id(sim), sim.time, view.sim is sim, sim.count, sim.viscosity, len(sim.forces)]")
    assert ours[:3] == [from_before, 0.0, True]
    assert ours[3:] == [150, 0.2, 1]  # poured water is gone; what was set, and a force that a cell gave, stays
    shown.run("sim.step()")
    assert shown.value("sim.time") > 0


def test_undo_brings_the_very_bits_back_into_that_very_object(shown):
    """A reset is undone, and that once more; the object of the cells stays, and another way to time goes on from it."""
    shown.run("sim.advance(0.4)")
    left = shown.value("[sim.digest(), sim.time, sim.count, id(sim)]")
    shown.say(do="reset")
    shown.custom("status", lambda status: status["time"] == 0.0)
    begun = shown.value("sim.digest()")
    shown.run("sim.step()")  # what the cells hold is the new world, and the one that was left stays as it was
    shown.say(do="undo")
    shown.custom("status", lambda status: status["time"] > 0.1)
    assert shown.value("[sim.digest(), sim.time, sim.count, id(sim)]") == left
    assert shown.value("[view.sim is sim, view.session.scene.title]") == [True, "Pool"]
    shown.run("sim.step()")
    assert shown.value("sim.time") > left[1]
    shown.say(do="undo")
    shown.custom("status", lambda status: status["time"] < 0.1)
    assert shown.value("[id(sim), sim.frame_number]") == [left[3], 1]
    shown.say(do="reset")
    shown.custom("status", lambda status: status["time"] == 0.0)
    assert shown.value("[sim.digest(), id(sim)]") == [begun, left[3]]
    shown.run("sim.step()")


def test_the_page_is_told_where_a_hand_would_act_and_what_fits(shown):
    """A ring on the surface, as shares of the picture; choices of detail with the pace to expect."""
    shown.say(do="hover", x=0.5, y=0.6, tool="stir", reach=0.2)
    aim, _ = shown.custom("aim")
    ring = aim["ring"]
    assert len(ring) > 20 and ring[0] == ring[-1]
    us, vs = [u for u, _ in ring], [v for _, v in ring]
    assert (min(us) + max(us)) / 2 == pytest.approx(0.5, abs=0.02)
    assert (min(vs) + max(vs)) / 2 == pytest.approx(0.6, abs=0.02)
    shown.say(do="fit")
    fit, _ = shown.custom("fit")
    assert set(fit) >= {"here", "scenes"}


def test_what_is_wrong_is_said_in_the_page_and_the_water_goes_on(shown):
    shown.say(do="set", name="viscosity", value="much")
    note, _ = shown.custom("note")
    assert "viscosity" in note["text"]
    shown.say(do="nonsense")
    note, _ = shown.custom("note")
    assert "'nonsense' is not a command" in note["text"]


def test_shown_again_it_is_the_same_show_and_stop_leaves_a_picture(shown):
    assert shown.value("wt.show(sim) is view") is True
    assert re.fullmatch(
        r"<wavetank in a notebook: <Simulation 'Pool': t = [\d.]+ s, .* on cpu>, paused>",
        shown.run("print(repr(view))"),
    )
    shown.run("view.stop()")
    updates = [m for m in shown.messages if m["msg_type"] == "update_display_data"]
    shown_first = next(
        m for m in shown.messages if m["msg_type"] == "display_data" and WIDGET_VIEW not in m["content"]["data"]
    )
    assert updates and "image/png" in shown_first["content"]["data"]
    assert shown.value("sim.time") > 0
    shown.run("sim.step()")


def test_a_saved_notebook_has_a_picture_and_no_address(tmp_path):
    cells = [SIM, "scene", "sim"]
    document = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(document, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    path = tmp_path / "pool.ipynb"
    nbformat.write(document, path)
    text = path.read_text()
    assert (
        "127.0.0.1" not in text and "localhost" not in text and "http://" not in text.replace("http://www.w3.org", "")
    )
    # A log that kernels are prepared may stand before them.
    poster, widget = (output for output in document.cells[0].outputs if output.output_type != "stream")
    from PIL import Image

    picture = Image.open(io.BytesIO(base64.b64decode(poster["data"]["image/png"])))
    assert picture.width == 640 and len(picture.convert("RGB").getcolors(1 << 20)) > 50  # water, not one colour
    assert len(poster["data"]["image/png"]) < 400_000
    assert WIDGET_VIEW in widget["data"]
    assert (
        document.cells[1]
        .outputs[0]["data"]["text/plain"]
        .startswith("<Scene 'Pool': 2-D, tank of 0.9 x 0.6 m, about 150")
    )
    assert document.cells[2].outputs[0]["data"]["text/plain"].startswith("<Simulation 'Pool': t = 0.3")


def test_outside_of_a_notebook_one_sentence_says_what_to_do():
    with pytest.raises(wt.WavetankError, match=r"wt\.show is for notebooks .* use wt\.render\(sim\)"):
        wt.show("drop-2d")

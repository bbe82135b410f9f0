"""Views of notebooks in a real browser: the cell of a saved notebook, and widgets in a page that speaks their protocol."""

from __future__ import annotations

import base64
import json
import sys

import pytest
from recorded_games import hunt, record

from tussle import Simulation, load_run
from tussle.errors import MissingExtraError, ParameterError
from tussle.view import Recording
from tussle.view.page.assemble import web_text

HOST = """<!doctype html><link rel="icon" href="data:,"><div id="cell"></div><script type="module">
%s
const listeners = [];
const model = {
  get: (name) => window.traits[name], on: (_, f) => listeners.push(f), off: () => {},
  send: (m) => window.kernel(JSON.stringify(m)),
};
window.deliver = (content, data) => {
  const buffers = data ? [new DataView(Uint8Array.from(atob(data), (c) => c.charCodeAt(0)).buffer)] : [];
  listeners.forEach((f) => f(content, buffers));
};
window.show = () => { window.leave = render({ model, el: document.getElementById('cell') }); };
</script>"""


class Notebook:
    """A page that shows a widget as a notebook does: what the one sends, the other gets."""

    def __init__(self, page, view):
        self.page, self.widget, self.sent = page, view.widget, []
        widget = view.widget
        self.is_kernel_there = True
        widget.send = lambda content, buffers=None: self.sent.append((content, list(buffers or [])))
        page.expose_function("kernel", self._receive)
        page.set_content(HOST % web_text("widget.js").replace("export default", "window.widget ="))
        traits = {"html": widget.html, "height": widget.height}
        page.evaluate("(traits) => { window.traits = traits; window.show(); }", traits)
        self.frame = page.frames[-1]
        self.frame.wait_for_url("about:srcdoc", wait_until="commit")  # it begins as an empty page

    def _receive(self, text):
        if self.is_kernel_there:
            self.widget._handle_custom_msg(json.loads(text), [])

    def until(self, condition, seconds=60.0):
        for _ in range(int(seconds / 0.02)):
            while self.sent:
                content, buffers = self.sent.pop(0)
                data = base64.b64encode(buffers[0]).decode() if buffers else None
                self.page.evaluate("([content, data]) => window.deliver(content, data)", [content, data])
            if value := condition():
                return value
            self.page.wait_for_timeout(20)
        raise AssertionError("it does not come")

    def press(self, name):
        """Click a button once it is there: while a click waits for it, nothing is delivered to the page."""
        button = self.frame.get_by_role("button", name=name, exact=True).first
        self.until(button.is_visible)
        button.click()

    def wait(self, expression):
        return self.until(lambda: self.frame.evaluate(f"() => Boolean(window.player) && ({expression})"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return record(hunt(n_prey=6, end=5.0), tmp_path_factory.mktemp("notebook") / "run")


def test_a_recorded_run_is_whole_in_its_cell(folder, watched):
    page = watched("nothing")
    page.set_content(f'<link rel="icon" href="data:,">{load_run(folder).view(height=400)._repr_html_()}')
    frame = page.frames[-1]
    frame.wait_for_url("about:srcdoc", wait_until="commit")
    for _ in range(1500):
        if frame.evaluate("() => Boolean(window.player && player.isReady && player.ids.length)"):
            break
        page.wait_for_timeout(20)
    assert sorted(frame.evaluate("() => player.ids")) == Recording(folder).frame(0).id.tolist()
    assert page.locator("iframe").bounding_box()["height"] == 400
    frame.evaluate("() => document.activeElement.blur()")
    frame.locator("canvas").first.click(position={"x": 5, "y": 200})
    page.keyboard.press("End")
    page.wait_for_timeout(300)
    assert frame.evaluate("() => player.t") == pytest.approx(5.0, abs=0.2)


def test_a_large_run_asks_the_kernel_for_what_it_shows(folder, watched, monkeypatch):
    pytest.importorskip("anywidget")
    monkeypatch.setattr("tussle.view.notebook.MAX_STATES", 10)
    notebook = Notebook(watched("nothing"), load_run(folder).view())
    assert len(notebook.widget.html) < 400_000
    notebook.wait(f"player.isReady && player.ids.length === {len(Recording(folder).frame(0))}")
    notebook.widget._handle_custom_msg({"do": "blob", "view": "other", "name": "nothing"}, [])
    assert notebook.sent[-1][0]["error"] == "There is nothing of this name."


def test_a_simulation_is_played_in_its_cell(watched):
    pytest.importorskip("anywidget")
    with Simulation(hunt(n_prey=6, end=60.0), 3) as simulation:
        view = simulation.view()
        notebook = Notebook(watched("nothing"), view)
        live = view.live
        notebook.wait(f"player.isReady && player.t === 0 && player.ids.length === {len(live.frame())}")
        notebook.press("Play")
        notebook.until(lambda: live.step_number > 3)
        notebook.wait("player.t > 0")
        notebook.press("Pause")
        notebook.until(lambda: live.is_paused and live.settle())
        notebook.wait(f"Math.abs(player.t - {live.t}) < 1e-6")
        gone = notebook.page.locator(".tussle-gone")
        assert not gone.is_visible()
        notebook.is_kernel_there = False
        notebook.until(gone.is_visible)
        assert "run the cell again" in gone.inner_text()
        notebook.is_kernel_there = True
        notebook.page.evaluate("() => window.leave()")
        notebook.until(lambda: not view._cells)
        view.stop()
        view.stop()


def test_without_anywidget_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with (
        Simulation(hunt(n_prey=1, end=1.0), 3) as simulation,
        pytest.raises(MissingExtraError, match=r"tussle\[notebook\]"),
    ):
        simulation.view()


def test_the_height_is_checked(folder):
    with pytest.raises(ParameterError, match="height"):
        load_run(folder).view(height=3)
    assert "notebooks show it" in repr(load_run(folder).view())

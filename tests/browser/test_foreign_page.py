"""Another page in the same browser, served from another port: it neither reads the game nor steers it."""

import http.server
import threading
from urllib.parse import urlsplit

import pytest
from recorded_games import hunt
from served import UNHURRIED, Watched
from waiting import wait_until

from tussle import Simulation
from tussle.view import Live
from tussle.view.page.server import Page

FOREIGN = """<!doctype html><meta charset="utf-8"><title>foreign</title><script>
const found = window.found = [];
const tell = (what, value) => found.push(what + ": " + value);
async function attack(addresses) {
  for (const address of addresses) {
    await fetch(address).then(async r => tell("read", (await r.text()).length), () => tell("fetch", "refused"));
    await fetch(address, {mode: "no-cors"}).then(r => tell("opaque", r.type), () => tell("no-cors", "refused"));
    await new Promise(done => {
      const socket = new WebSocket(address.replace("http", "ws"));
      socket.onopen = () => { tell("socket", "OPEN"); socket.send('{"do": "step", "n": 1}'); };
      socket.onmessage = () => tell("message", "READ");
      socket.onerror = () => tell("socket", "refused");
      socket.onclose = () => setTimeout(done, 50);
      setTimeout(done, 5000);
    });
    await new Promise(done => {
      const frame = document.createElement("iframe");
      frame.onload = () => { try { tell("frame", frame.contentDocument ? "own" : "closed"); } catch { tell("frame", "closed"); } done(); };
      frame.src = address; document.body.append(frame);
    });
  }
  tell("all", "done");
}
</script><body></body>"""


@pytest.fixture
def foreign():
    """A page of somebody else, at a port of its own."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(FOREIGN.encode())

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_a_foreign_page_neither_reads_nor_steers(chromium, foreign):
    with (
        Simulation(hunt(n_prey=6, end=120.0, end_conditions="time"), 3) as simulation,
        Live(simulation, is_paused=True) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page)
        tab = chromium.new_page()
        try:
            tab.goto(foreign)
            root = f"http://{urlsplit(page.url).netloc}/"
            # Even one that has heard of the token is refused: its Origin is not the page's own.
            addresses = [root, root.replace("127.0.0.1", "localhost"), page.url]
            tab.evaluate("(a) => { attack(a); }", addresses)
            found = wait_until(tab, 'found.includes("all: done") && found')
        finally:
            tab.close()
        words = {text.partition(": ")[0]: text.partition(": ")[2] for text in found}
        assert {"read", "message"}.isdisjoint(words), found
        assert found.count("socket: refused") == len(addresses), found
        assert found.count("fetch: refused") == len(addresses), found
        assert "frame: own" not in found
        assert page.n_readers == 1
        assert live.settle()
        assert live.step_number == 0
        watched.button("A step on")
        watched.until(lambda: live.step_number == 1)
        watched.close()
        assert not watched.trouble

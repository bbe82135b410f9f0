"""A page that shows the game late, with a person whose address has a name."""

from contrast import faint_texts
from served import UNHURRIED, Watched

from tussle import Block, Mission, Simulation
from tussle.stock import GoTo, SingleIntegrator
from tussle.view import Live, OperatorLink
from tussle.view.page.access import PageRole
from tussle.view.page.server import Page

LATE = 2.0


def test_an_operator_sees_the_game_late_and_gives_orders_to_an_entity_chosen_just_now(chromium):
    robots = Block(
        name="robot", team=1, count=3, variance=(90, 90, 0), autonomy=GoTo(), motion=SingleIntegrator()
    )
    mission = Mission(name="late", blocks=[robots], dt=0.1, end=1e3, end_conditions="time")
    with (
        Simulation(mission, 1) as simulation, Live(simulation, is_paused=True, link=OperatorLink(see=LATE)) as live,
        Page(live, viewer=UNHURRIED, operators={"Zoë [b]<i>": 1}) as page,
    ):  # fmt: skip
        watched = Watched(chromium, page, url=page.addresses[PageRole("operate", 1, "Zoë [b]<i>")])
        watched.wait(
            "document.querySelector('#subtitle').innerText.includes('Zoë [b]<i>, you operate team 1')"
        )
        assert not faint_texts(watched.tab, [[255, 255, 255]])
        assert any("what is seen is 2 s old" in note for note in watched.wait("player.status")["notes"])
        live.resume()
        watched.until(lambda: live.t > LATE + 1.0)
        shown, now = watched.wait("player.t"), live.t  # in this order: the game goes on
        assert 0.0 < shown <= now - LATE
        live.pause()
        assert live.settle()
        watched.press("ArrowRight")
        watched.wait("player.chosen === 1 && !document.querySelector('#orders').hidden")
        for part, value in zip("xyz", "730", strict=True):
            watched.tab.get_by_label(f"pos {part}", exact=True).fill(value)
        watched.tab.keyboard.press("Enter")
        watched.until(lambda: live.injections)
        (given,) = live.injections
        assert (given.by, given.to) == ("Zoë [b]<i> (operate team 1)", (1,))
        assert watched.wait("player.status")["t"] <= live.t - LATE + 1e-9
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)

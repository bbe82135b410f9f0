"""State machines, what follows them, and the behaviour that trails an entity."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import (
    Autonomy,
    Behavior,
    Children,
    Controller,
    EntityRef,
    Handle,
    Input,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.errors import MissionError, ParameterError, PluginError, WiringError
from tussle.messages import CaptureEntity, TextMessage
from tussle.mission import read_mission
from tussle.plugins.stock.autonomy.graphviz_fsm.dot import read_dot
from tussle.stock import (
    AutonomyExecutor,
    GraphvizFSM,
    MotorSchemas,
    MoveToGoalMS,
    NoisyContacts,
    Straight,
    TopicRelay,
    TrailMS,
)
from tussle.testing import check_plugin


class Script(Autonomy):
    """Says a word of its script, one letter per event, in the step of its place; - says nothing."""

    grade = "portable"
    words = Param("", doc="One letter per step.")
    topic = Param("Event")
    told = Publish(TextMessage, network="LocalNetwork", topic_param="topic")

    def step(self, g):
        for row in range(g.n):
            k = int(g.step_count[row])
            if k < len(self.words) and self.words[k] != "-":
                for letter in self.words[k] if self.words[k] != "2" else "xy":
                    self.told.publish([row], text=[letter])


class Chance(Autonomy):
    """Tells states or events by chance, for the conformance kit."""

    grade = "portable"
    words = Param("a b c event1 event2 event3 event4 event5")
    topic = Param("Event")
    told = Publish(TextMessage, network="LocalNetwork", topic_param="topic")

    def step(self, g):
        words = self.words.split()
        rows = np.flatnonzero(g.uniform("say") < 0.5)
        number = (g.uniform("word") * len(words)).astype(int)
        self.told.publish(rows, text=[words[i] for i in number[rows]])


class Ear(Autonomy):
    """Writes down what it hears of states."""

    log = Handle()
    told = Subscribe(TextMessage, network="LocalNetwork", topic="State")

    def open_one(self, row):
        return []

    def step(self, g):
        rows, heard = self.told.pairs()
        for row, text in zip(rows, heard.text, strict=True):
            self.log[row].append((int(g.step_count[row]), text))


def heard(sim, name="a"):
    group = next(g for g in sim.state.population.groups if name in g.names)
    return next(b for b in group.walk() if b.path == ("Ear",)).handles["log"][0]


# -- graphs -----------------------------------------------------------------------------------------------------------------------


def test_dot_is_read_with_all_that_its_grammar_has():
    graph = read_dot("""# made by hand
        strict DiGraph "of all" { // a comment
            rankdir=LR; graph [bgcolor = white]; node [shape="circle", width=.5]
            a:n -> b:s:w -> "c d" [label="go" + " on", color=red] [weight=-2];
            subgraph cluster_1 { edge [label=in]; {e f} -> g h } /* another
            comment */ -> a
            a -> Ünder_1; "say \\"so\\""
        }""")
    assert graph.nodes == ("a", "b", "c d", "e", "f", "g", "h", "Ünder_1", 'say "so"')
    assert [tuple(edge) for edge in graph.edges] == [
        ("a", "b", "go on"), ("b", "c d", "go on"), ("e", "g", "in"), ("f", "g", "in"),
        ("e", "a", ""), ("f", "a", ""), ("g", "a", ""), ("h", "a", ""), ("a", "Ünder_1", ""),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", r"line 1, column 1 of the graph: the end is not allowed; expected 'digraph'"),
        ("graph { a }", r"'graph' is not allowed; expected 'digraph', as edges have directions"),
        ("digraph {\n a -- b }", r"line 2, column 4 .*'--' is not allowed; expected '->'"),
        ("digraph {\n a -> }", r"line 2, column 7 .*'}' is not allowed; expected a node, '{' or '}'"),
        ("digraph { a [label=] }", r"'\]' is not allowed; expected a value"),
        ("digraph { a [label x] }", r"'x' is not allowed; expected '='"),
        ("digraph { a [=x] }", r"'=' is not allowed; expected an attribute or '\]'"),
        ("digraph { a", r"the end is not allowed"),
        ("digraph { a } b", r"'b' is not allowed; expected the end"),
        ("digraph { a -> <b>b</b> }", r"column 16 .*'<b>b</b> }' is not allowed; expected a name, a text"),
        ('digraph { "a }', r"expected a name, a text in double quotes"),
        ("digraph " + "{" * 51, r"expected at most 50 nested subgraphs"),
    ],
)
def test_a_text_that_is_no_digraph_is_refused_with_its_place(text, error):
    with pytest.raises(ParameterError, match=error):
        read_dot(text)


@pytest.mark.parametrize(
    ("graph", "error"),
    [
        (
            "digraph { quit -> a }",
            r"no node 'qi' to begin with \(did you mean 'quit'\?\); there are: quit, a",
        ),
        ("digraph { qi -> a [label=x]; qi -> b [label=x] }", r"node 'qi' .* two edges with the label 'x'"),
        ("digraph { qi -> a; qi -> b [label=x] }", r"an edge without label beside another one"),
    ],
)
def test_a_graph_that_is_no_machine_is_refused(graph, error):
    with pytest.raises(ParameterError, match=error):
        GraphvizFSM(graphviz_fsm=graph)


def test_a_mission_file_says_in_which_line_its_machine_is_wrong(tmp_path):
    path = tmp_path / "m.xml"
    path.write_text(
        '<runscript>\n<entity>\n<autonomy graphviz_fsm="digraph { qi -&gt; }">GraphvizFSM</autonomy>\n</entity></runscript>'
    )
    with pytest.raises(MissionError, match=r"m.xml:3: line 1, column 17 of the graph: '}' is not allowed"):
        read_mission(path)


# -- the machine ------------------------------------------------------------------------------------------------------------------

TURNSTILE = "digraph { qi -> a; a -> b [label=x]; b -> a [label=y]; b -> c [label=z]; c -> qi }"


@pytest.mark.parametrize(
    ("words", "states"),
    [
        ("", [(1, "a")]),
        ("x", [(1, "a"), (2, "b")]),  # said in step 0, heard by the machine in step 1, which is then in a
        ("y--x-y", [(1, "a"), (5, "b"), (7, "a")]),  # a does not know y
        ("-xz", [(1, "a"), (3, "b"), (4, "c"), (5, "qi"), (6, "a")]),  # edges without label, one step each
        ("-2", [(1, "a"), (3, "b"), (3, "a")]),  # x and y in one step: both, in their order
    ],
)
def test_a_machine_follows_its_events_and_tells_its_states(words, states):
    fsm = GraphvizFSM(graphviz_fsm=TURNSTILE)
    sim = Simulation(mission(block(autonomy=[Drift(), Script(words=words), fsm, Ear()])))
    sim.step(9)
    assert heard(sim) == states


def test_a_machine_whose_first_state_stays_tells_that():
    fsm = GraphvizFSM(graphviz_fsm="digraph { on -> off [label=x] }", initial_node_name="on")
    sim = Simulation(mission(block(autonomy=[Drift(), fsm, Ear()])))
    sim.step(9)
    assert heard(sim) == [(1, "on")]


def test_machines_of_one_group_are_in_states_of_their_own():
    fsm = GraphvizFSM(graphviz_fsm=TURNSTILE)
    late = block(count=2, rate=2.0, first_birth=0.3, autonomy=[Drift(), Script(words="-x-y"), fsm])
    sim = Simulation(mission(late))
    sim.step(5)
    node, alive = sim.read("a.GraphvizFSM.node")
    assert node[alive].tolist() == [1]  # born after x was said
    early = Simulation(mission(block(autonomy=[Drift(), Script(words="-x-y"), fsm])))
    early.step(3)
    assert early.read("a.GraphvizFSM.node")[0].tolist() == [[2]]


# -- behaviours with states -------------------------------------------------------------------------------------------------------


class Wish(Behavior):
    """Wishes one velocity, counts its calls and says each."""

    grade = "portable"
    to = Param((0.0, 0.0, 0.0), fields="x y z", unit="m/s")
    calls = State(dtype=int)
    trace = State(ragged=True)
    said = Publish(CaptureEntity)
    last = EntityRef()
    memory = Handle()

    def step(self, g):
        self.desired_velocity[:] = self.to
        self.calls[:] += 1
        self.trace.set(np.arange(g.n + 1), self.calls.astype(float))
        self.last[:] = g.id
        self.memory[:] = self.calls.tolist()
        self.said.publish(np.arange(g.n), target=self.last)


def test_a_behaviour_acts_in_its_states_only_and_rests_otherwise():
    wishes = [
        Wish(to=(4.0, 0.0, 0.0)),
        Wish(to=(0.0, 4.0, 0.0), states="x, y", name="xy"),
        Wish(to=(0.0, 0.0, 4.0), states="y z", name="yz"),
    ]
    flier = MotorSchemas(behaviors=wishes)
    blocks = [
        block("a", autonomy=[Script(words="-x--y--w", topic="State"), flier]),
        block("b", autonomy=[Script(words="-z", topic="State"), flier]),
    ]
    sim = Simulation(mission(*blocks, end=2.0))
    seen, calls = [], []
    for _ in range(10):
        sim.step()
        seen.append((sim.read("a.pos")[0][0, 0] / 0.4).round(12).tolist())
        calls.append(
            [int(sim.read(f"a.MotorSchemas.{name}.calls")[0][0, 0]) for name in ("Wish", "xy", "yz")]
        )
    alone, two, three = [1, 0, 0], [0.5, 0.5, 0], [1 / 3] * 3
    velocities = [alone, alone, two, two, two, three, three, three, alone, alone]  # heard a step later
    assert np.allclose(np.diff(seen, axis=0), velocities[1:])
    assert calls[-1] == [10, 6, 3]
    trace = sim.read("a.MotorSchemas.yz.trace")[0][0, 0]
    assert trace.tolist() == [3.0]
    group = next(g for g in sim.state.population.groups if "a" in g.names)
    assert next(b for b in group.walk() if b.path[-1:] == ("xy",)).handles["memory"][0] == 6
    assert sim.read("b.MotorSchemas.yz.calls")[0][0, 0] == 8


def test_who_rests_says_nothing():
    class Count(Autonomy):
        heard = State(dtype=int)
        told = Subscribe(CaptureEntity)

        def step(self, g):
            rows, _ = self.told.pairs()
            np.add.at(self.heard, rows, 1)

    flier = MotorSchemas(behaviors=[Wish(states="x")])
    script = Script(words="-x--w", topic="State")
    sim = Simulation(mission(block(autonomy=[script, flier]), block("b", autonomy=[Drift(), Count()])))
    sim.run()
    assert sim.read("b.Count.heard")[0][0, 0] == 3


def test_states_are_for_plugins_inside_those_that_follow_them(tmp_path):
    with pytest.raises(
        MissionError,
        match=r"Straight\(states='a, b'\) has states, which only plugins inside another one follow",
    ):
        block(autonomy=Straight(states="a b"))

    class Deaf(Autonomy):
        inner = Children(Behavior)

    with pytest.raises(
        ParameterError, match=r"MoveToGoalMS\(states='a'\) cannot have states; Deaf does not follow"
    ):
        Deaf(inner=[MoveToGoalMS(states=["a"])])
    inner = MoveToGoalMS(states="a b")
    assert inner.replace(gain=2.0).active_in == ("a", "b")
    assert inner != MoveToGoalMS()
    assert inner.structure() != MoveToGoalMS().structure()
    path = tmp_path / "m.xml"
    path.write_text(
        "<runscript><entity><autonomy behaviors=\"[ MoveToGoalMS states='Go, Return' gain='2' ]\">MotorSchemas</autonomy>"
        "<autonomy autonomies=\"[ Straight states='Go' speed='9' ]\">AutonomyExecutor</autonomy></entity></runscript>"
    )
    schemas, executor = read_mission(path).mission.blocks[0].autonomy
    assert schemas.values["behaviors"] == (MoveToGoalMS(states="Go, Return", gain=2.0),)
    assert executor.values["autonomies"] == (Straight(states="Go", speed=9.0),)


def test_behaviours_meet_the_contract_while_states_change():
    behaviors = [MoveToGoalMS(states="b c", distance_pid=(0.5, 0.1, 0.1, 1e6)), TrailMS(trail_id=2)]
    check_plugin(MotorSchemas, behaviors=behaviors, companions=[Chance(words="a b c", topic="State")])


def test_a_machine_meets_the_contract_while_events_happen():
    check_plugin(GraphvizFSM, companions=[Chance()])


def test_an_executor_meets_the_contract_while_states_change():
    autonomies = [Turner(), Turner(states="a b", name="T")]
    check_plugin(AutonomyExecutor, autonomies=autonomies, companions=[Chance(words="a b c", topic="State")])


# -- autonomies by state ----------------------------------------------------------------------------------------------------------


class Turner(Autonomy):
    """Flies faster in each step since it began, along the heading of that time."""

    grade = "portable"
    to = Param(1.0, unit="m/s")
    begun = State("x y z", unit="m")
    age = State(dtype=int)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    capture = Publish(CaptureEntity)

    def spawn(self, g, rows):
        self.begun[:, rows] = g.pos[:, rows]

    def step(self, g):
        self.age[:] += 1
        self.velocity[0] = self.to * self.age
        self.velocity[1:] = 0.0
        self.capture.publish(np.arange(g.n), target=g.id)


def test_an_executor_runs_the_autonomies_of_the_state_and_begins_them_anew():
    executor = AutonomyExecutor(autonomies=[Turner(states="x"), Turner(to=-1.0, states="y", name="back")])
    blocks = [
        block("a", autonomy=[Script(words="-x--y-x--w", topic="State"), executor]),
        block("b", autonomy=[Script(words="-----y", topic="State"), executor]),
    ]
    sim = Simulation(mission(*blocks, end=1.2), seeds=[1, 2])
    seen = []
    for _ in range(12):
        sim.step()
        seen.append(sim.read("a.vel")[0][0, 0, 0])
    # x is heard in step 2, y in 5, x in 7, w in 10: then nobody writes the velocity.
    assert np.allclose(seen, [0, 0, 1, 2, 3, -1, -2, 1, 2, 3, 3, 3])
    assert sim.read("b.vel")[0][:, 0, 0] == pytest.approx([-6.0, -6.0])
    assert sim.read("a.AutonomyExecutor.Turner.begun")[0][0, 0, 0] == pytest.approx(0.1 * (1 + 2 + 3 - 1 - 2))


def test_an_executor_hands_on_the_inputs_of_sensors_and_names_who_is_wrong():
    class Look(Autonomy):
        seen = Input(
            "contacts",
            ragged=True,
            fields="id team x y z vx vy vz qw qx qy qz",
            unit="1 1 m m m m/s m/s m/s 1 1 1 1",
        )
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[:] = self.seen.count

    def game(*inner, **values):
        return mission(block(count=3, autonomy=AutonomyExecutor(autonomies=inner), **values))

    sim = Simulation(game(Look(), sensor=NoisyContacts(max_range=1e3)))
    sim.run()
    assert (sim.read("a.vel")[0] == 2.0).all()
    with pytest.raises(WiringError, match=r"no plugin writes channel 'contacts' for Look"):
        Simulation(game(Look()))

    class Apart(Controller):
        first = Input("velocity_x", unit="m/s")
        last = Input("velocity_z", unit="m/s")
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[:] = self.first

    with pytest.raises(
        WiringError,
        match=r"AutonomyExecutor.Turner.velocity: .* velocity_x velocity_y velocity_z are read separately",
    ):
        Simulation(game(Turner(), controller=Apart()))

    class Nan(Turner):
        def step(self, g):
            self.velocity[:] = np.nan

    with pytest.raises(PluginError, match=r"Nan, a 1, world 0, step 0: output 'velocity_x' = nan"):
        Simulation(game(Nan()), on_error="raise").run()


# -- relays -----------------------------------------------------------------------------------------------------------------------


def test_commands_from_outside_reach_the_plugins_of_the_entities_that_they_are_for(tmp_path):
    path = tmp_path / "m.xml"
    path.write_text(
        """<runscript><run dt="0.1" end="5"/><entity><name>a</name><count>2</count>
        <autonomy relays="[ GlobalNetwork Event LocalNetwork ] [ GlobalNetwork Distance LocalNetwork ]">CommandStringRelay</autonomy>
        <autonomy graphviz_fsm="digraph { qi -&gt; b [label=go] }">GraphvizFSM</autonomy></entity></runscript>"""
    )
    game = read_mission(path).mission
    relay = game.blocks[0].autonomy[0]
    assert [r.values["topic"] for r in relay.values["relays"]] == ["Event", "Distance"]
    sim = Simulation(game, seeds=[1, 2])
    sim.publish(TextMessage, topic="Event", text="go", to=2)
    sim.step(4)
    assert sim.read("a.GraphvizFSM.node")[0].tolist() == [[0, 1], [0, 1]]
    sim.publish(TextMessage, topic="Event", text="go")
    sim.step(4)
    assert sim.read("a.GraphvizFSM.node")[0].tolist() == [[1, 1], [1, 1]]


def test_relays_that_are_wrong(tmp_path):
    with pytest.raises(ParameterError, match=r"source and target are both 'LocalNetwork'; they must differ"):
        TopicRelay(source="LocalNetwork")
    path = tmp_path / "m.xml"
    for rows, error in (
        ("[ GlobalNetwork State ]", r"it takes rows \[ source topic target \]"),
        ("GlobalNetwork State LocalNetwork", r"rows are written \[ ... \]"),
    ):
        path.write_text(
            f'<runscript>\n<entity><autonomy relays="{rows}">CommandStringRelay</autonomy></entity></runscript>'
        )
        with pytest.raises(MissionError, match=f"m.xml:2: .*{error}"):
            read_mission(path)


# -- trailing ---------------------------------------------------------------------------------------------------------------------


def trailing(steps, leader=(0.0, 0.0, 0.0), sensor=(), max_speed=1e6, **values):
    behaviors = [TrailMS(trail_id=1, trail_range=10.0, **values)]
    leading = block(
        "leader", position=(100.0, 50.0, 20.0), heading="90 deg", climb="30 deg", autonomy=Drift(to=leader)
    )
    trail = block(autonomy=MotorSchemas(max_speed=max_speed, behaviors=behaviors), sensor=sensor)
    sim = Simulation(mission(leading, trail, dt=0.1, end=1000.0))
    sim.step(steps)
    return sim.read("a.pos")[0][0, 0], sim.read("leader.pos")[0][0, 0], sim


def test_the_distance_to_the_point_decays_exponentially():
    # The nose points to (0, cos 30, sin 30); each step of 0.1 s takes a tenth of the way.
    point = np.array([100.0, 50.0 - 10.0 * np.sqrt(0.75), 15.0])
    pos, _, _ = trailing(20)
    assert pos == pytest.approx(point * (1.0 - 0.9**20))
    pos, _, _ = trailing(150, trail_angle_azimuth="90 deg", trail_angle_elevation="45 deg")
    beside = np.array([-1.0, 0.0, 0.0]) * np.sqrt(0.5) + np.array([0.0, -0.5, np.sqrt(0.75)]) * np.sqrt(0.5)
    assert pos == pytest.approx(np.array([100.0, 50.0, 20.0]) + 10.0 * beside, abs=1e-4)


def test_a_moving_leader_is_followed_without_lag_and_never_faster_than_allowed():
    pos, leader, sim = trailing(400, leader=(3.0, 4.0, 0.0))
    assert leader - pos == pytest.approx([6.0, 8.0, 0.0], abs=1e-6)
    assert np.linalg.norm(sim.read("a.vel")[0][0, 0]) == pytest.approx(5.0)
    _, _, sim = trailing(5, leader=(3.0, 4.0, 0.0), max_speed=7.0)
    assert np.linalg.norm(sim.read("a.vel")[0][0, 0]) == pytest.approx(7.0)


def test_a_leader_may_be_measured_or_missing():
    still = {f"{what}_noise_{i}": (0.0, 0.0) for what in ("pos", "vel", "orient") for i in range(3)}
    still |= {"pos_noise_1": (1.0, 0.0), "pos_noise_2": (2.0, 0.0)}
    pos, _, _ = trailing(150, max_speed=50.0, contacts="noisy", sensor=NoisyContacts(max_range=1e3, **still))
    assert pos == pytest.approx([100.0, 51.0 - 10.0 * np.sqrt(0.75), 17.0], abs=0.5)
    _, _, sim = trailing(3, contacts="noisy", sensor=NoisyContacts(max_range=20.0))
    assert sim.read("a.MotorSchemas.TrailMS.desired_velocity")[0].tolist() == [[[0.0, 0.0, 0.0]]]
    alone = Simulation(mission(block(autonomy=MotorSchemas(behaviors=[TrailMS()]))))
    alone.run()
    assert alone.read("a.MotorSchemas.TrailMS.desired_velocity")[0].tolist() == [[[0.0, 0.0, 0.0]]]

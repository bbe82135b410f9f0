"""Policies with memory fly as in the library that trained them, and each entity has a memory of its own."""

from __future__ import annotations

import numpy as np
import pytest
from needs import NEEDS

pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")
pytest.importorskip("onnx", reason="onnx is not installed: pip install 'tussle[policy]'")
pytest.importorskip("gymnasium", reason="gymnasium is not installed: pip install 'tussle[rl]'")

import onnx
from onnx import TensorProto, helper, numpy_helper

from tussle import Simulation
from tussle.errors import ParameterError, PluginError
from tussle.rl import Dispersal, NearOrigin, PredatorTeam, make_swarm, write_policy
from tussle.rl.flight import BATCH, MAX_MEMORY_NUMBERS, Policy
from tussle.stock import Learned

N_TEAM = 3 + 3 * 8 + 5


def end(name, *shape, kind=TensorProto.FLOAT):
    return helper.make_tensor_value_info(name, kind, shape)


def save(path, nodes, inputs, outputs, tensors=None, task=""):
    kept = [numpy_helper.from_array(np.asarray(array), name) for name, array in (tensors or {}).items()]
    graph = helper.make_graph(nodes, "g", inputs, outputs, kept)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {"tussle.task": task})
    onnx.save_model(model, str(path))
    return str(path)


def by_gate(weight):
    """Rows of PyTorch's weights, (3 memory, ...), in ONNX's order of the gates: update, reset, new."""
    reset, update, new = np.split(weight, 3)
    return np.concatenate([update, reset, new])[None]


def gru_policy(path, weights, n_in, task):
    """A GRU and a linear layer; weights are those of PyTorch: weight_ih, weight_hh, bias_ih, bias_hh, weight and bias."""
    w_ih, w_hh, b_ih, b_hh, weight, bias = (np.asarray(each, np.float32) for each in weights)
    n = w_hh.shape[1]
    tensors = {
        "w": by_gate(w_ih),
        "r": by_gate(w_hh),
        "b": np.concatenate([by_gate(b_ih), by_gate(b_hh)], axis=1),
        "weight": weight,
        "bias": bias,
        "first": np.array([0]),
    }
    nodes = [
        helper.make_node("Unsqueeze", ["observation", "first"], ["sequence"]),
        helper.make_node(
            "GRU", ["sequence", "w", "r", "b", "", "h"], ["", "h_out"], hidden_size=n, linear_before_reset=1
        ),
        helper.make_node("Squeeze", ["h_out", "first"], ["inner"]),
        helper.make_node("Gemm", ["inner", "weight", "bias"], ["action"], transB=1),
    ]
    ends = (
        [end("observation", "n", n_in), end("h", 1, "n", n)],
        [
            end("action", "n", len(bias)),
            end("h_out", 1, "n", n),
        ],
    )
    return save(path, nodes, *ends, tensors, task)


def drawn_policy(path, n_in, n_out, task, n=6):
    chance = np.random.default_rng(4)
    shapes = (3 * n, n_in), (3 * n, n), (3 * n,), (3 * n,), (n_out, n), (n_out,)
    return gru_policy(path, [chance.normal(0, 0.5, shape) for shape in shapes], n_in, task)


def counting_policy(path, task, n_in, n_out, n_kept=1):
    """Keeps the number of its decisions."""
    nodes = [
        helper.make_node("Gemm", ["a", "zero"], ["b"]),
        helper.make_node("Add", ["count", "one"], ["more"]),
    ]
    ends = [end("a", "n", n_in), end("count", "n", n_kept)], [end("b", "n", n_out), end("more", "n", n_kept)]
    tensors = {"zero": np.zeros((n_in, n_out), np.float32), "one": np.ones(1, np.float32)}
    return save(path, nodes, *ends, tensors, task)


def team(tmp_path):
    return PredatorTeam(), "switchers", drawn_policy(tmp_path / "p.onnx", N_TEAM, 2, "tussle/PredatorTeam-v0")


def newcomers(tmp_path):
    """Robots that enter one by one."""
    path = drawn_policy(tmp_path / "p.onnx", sum(Dispersal().widths["robot"]), 5, "tussle/Dispersal-v0")
    return Dispersal(), "robot", path


def flown(task, owner, path):
    """The mission of a task, in which a policy flies a block beside the autonomies that the task keeps."""
    blocks = [
        b.replace(autonomy=(*b.autonomy, Learned(policy=path))) if b.name == owner else b
        for b in task.given.blocks
    ]
    return task.given.replace(blocks=blocks)


def solo(path):
    """The robot of RLSimple, flown by a policy."""
    mission = NearOrigin().given
    return mission.replace(blocks=[mission.blocks[0].replace(autonomy=Learned(policy=str(path)))])


def test_a_gru_of_pytorch_flies_as_in_pytorch(tmp_path):
    torch = pytest.importorskip("torch", reason=NEEDS["torch"].reason)
    torch.manual_seed(2)
    gru, head = torch.nn.GRU(N_TEAM, 12), torch.nn.Linear(12, 2)
    weights = [each.detach().numpy() for each in (*gru.parameters(), *head.parameters())]
    path = gru_policy(tmp_path / "gru.onnx", weights, N_TEAM, "tussle/PredatorTeam-v0")
    task, state, forgetful = PredatorTeam(), torch.zeros(1, 10, 12), []
    swarm = make_swarm(task, 2)
    obs = swarm.reset(seed=5)
    with torch.no_grad():
        for _ in range(40):
            seen = torch.from_numpy(obs.reshape(1, 10, N_TEAM))
            forgetful.append((head(gru(seen)[0]) - head(gru(seen, state)[0])).abs().max())
            inner, state = gru(seen, state)
            obs, *_ = swarm.step(head(inner).numpy().reshape(2, 5, 2))
    assert max(forgetful) > 0.1
    with Simulation(flown(task, "switchers", path), seeds=[5, 6]) as simulation:
        simulation.step(80)
        kept = simulation.read("switchers.Learned.memory")[0]
        np.testing.assert_allclose(kept.reshape(10, 12), state[0], atol=1e-4)
        for path in ("switchers.pos", "prey.vel"):
            there, at = simulation.read(path)[0], swarm.simulation.read(path)[0]
            np.testing.assert_allclose(there, at, atol=1e-2)


@pytest.mark.parametrize("game", [team, newcomers])
def test_memory_belongs_to_an_entity_in_any_stack(game, tmp_path):
    """By hashes, of which the memory is part: in stacks and threads, after resets of some worlds, and from snapshots."""
    task, owner, path = game(tmp_path)
    mission, seeds = flown(task, owner, path), list(range(1, 26))
    with Simulation(mission, seeds=[seeds[3]]) as alone:
        alone.step(60)
        expected = alone.state_hash()
        assert np.nanmax(np.abs(alone.read(f"{owner}.Learned.memory")[0])) > 0.1
    with Simulation(mission, seeds=seeds, threads=2) as many:
        assert sum(block.count for block in mission.blocks if block.name == owner) * len(seeds) > BATCH
        many.step(30)
        middle = many.snapshot()
        many.step(30)
        whole = [many.state_hash(k) for k in range(25)]
        assert whole[3] == expected
        many.step(17)
        many.reset([3, 7])
        many.step(60)
        assert [many.state_hash(k) for k in (3, 7)] == [whole[3], whole[7]]
        many.restore(middle)
        many.step(30)
        assert [many.state_hash(k) for k in range(25)] == whole
    with Simulation(mission, seeds=seeds) as other:
        other.restore(middle)
        other.step(30)
        assert [other.state_hash(k) for k in range(25)] == whole


def test_the_born_begin_with_zeros(tmp_path):
    path = counting_policy(
        tmp_path / "p.onnx", "tussle/Dispersal-v0", sum(Dispersal().widths["robot"]), 5, n_kept=3
    )
    with Simulation(flown(Dispersal(), "robot", path), seeds=[1, 2]) as simulation:
        every, counts = Dispersal.decide_every, []
        simulation.step(20 * every)
        kept, there = simulation.read("robot.Learned.memory")
        bodies = simulation.state.population.bodies
        for world in range(2):
            age = 20 * every - bodies.born[bodies.world == world]
            expected = np.sort(np.ceil(age / every))
            counts.append(len(set(expected)))
            np.testing.assert_array_equal(
                np.sort(kept[world][there[world]], axis=0), np.repeat(expected[:, None], 3, axis=1)
            )
        assert min(counts) > 2


def test_policies_of_a_folder_keep_different_numbers(tmp_path):
    for name, n_kept in (("one", 1), ("three", 3)):
        counting_policy(tmp_path / f"{name}.onnx", "tussle/RLSimple-v0", 2, 2, n_kept)
    write_policy(tmp_path / "none.onnx", [(np.zeros((2, 2)), np.zeros(2))], task="tussle/RLSimple-v0")
    with Simulation(solo(tmp_path), seeds=range(1, 31)) as simulation:
        simulation.step(4)
        kept = simulation.read("robot.Learned.memory")[0].reshape(30, 3)
        assert {tuple(row) for row in kept} == {(0, 0, 0), (4, 0, 0), (4, 4, 4)}


def test_several_inputs_are_kept_each_in_its_form(tmp_path):
    """Agents are the axis of free size: the first of `age`, the middle one of `seen`."""
    nodes = [
        helper.make_node("Add", ["age", "one"], ["age_out"]),
        helper.make_node("Unsqueeze", ["a", "first"], ["now"]),
        helper.make_node("Concat", ["now", "seen"], ["two"], axis=0),
        helper.make_node("Slice", ["two", "zero", "end"], ["seen_out"]),
        helper.make_node("Slice", ["seen", "first", "two_rows"], ["oldest"]),
        helper.make_node("Squeeze", ["oldest", "zero"], ["b"]),
    ]
    tensors = {
        "one": np.ones(2, np.float32),
        "first": np.array([0]),
        "zero": np.array([0]),
        "end": np.array([2]),
        "two_rows": np.array([1]),
    }
    path = save(
        tmp_path / "p.onnx",
        nodes,
        [end("a", "n", 2), end("age", "n", 2), end("seen", 2, "n", 2)],
        [end("b", "m", 2), end("age_out", "n", 2), end("seen_out", "x", "y", 2)],
        tensors,
    )
    policy = Policy(path)
    assert policy.n_kept == 6
    obs = np.random.default_rng(1).normal(size=(4, 100, 2)).astype(np.float32)
    kept, outs = np.zeros((100, 6)), []
    for k in range(4):
        out, kept = policy(obs[k], kept)
        outs.append(out)
    np.testing.assert_array_equal(outs[3], obs[2])
    np.testing.assert_array_equal(kept, np.concatenate([np.full((100, 2), 4.0), obs[3], obs[2]], axis=1))


def test_a_policy_without_memory_has_no_part_in_the_hash():
    assert Learned(policy="prey_escape").unused_states() == ("memory",)
    assert Learned(policy="prey_escape").state_size("memory") == 1


SAME = helper.make_node("Identity", ["h"], ["h2"])
TWICE = helper.make_node("Concat", ["h", "h"], ["h2"], axis=1)
WHOLE = helper.make_node("Cast", ["h"], ["h2"], to=TensorProto.INT64)
WIDE = MAX_MEMORY_NUMBERS + 1


H, H2, N_INT = end("h", "n", 3), end("h2", "n", 3), TensorProto.INT64


@pytest.mark.parametrize(
    ("given", "returned", "node", "message"),
    [
        (H, None, None, r"inputs are 'a' .*, 'h' .*, its outputs 'b' .*; a policy has as many outputs as inputs"),
        (None, H2, "a", r"inputs are 'a' tensor\(float\) \['n', 2\], its outputs .*as many outputs"),
        (H, end("h2", "n", 6), TWICE, r"'h2' .*\['n', 6\] returns does not fit 'h' .*\['n', 3\]"),
        (H, end("h2", "n", 3, kind=N_INT), WHOLE, r"'h2' tensor\(int64\) .* does not fit 'h' tensor\(float\)"),
        (end("h", "n", "m"), end("h2", "n", "m"), SAME, r"'h' .*\['n', 'm'\] is not allowed; .*others are fixed"),
        (end("h", 1, 3), end("h2", 1, 3), SAME, r"'h' .*\[1, 3\] is not allowed; .* the number of agents, is free"),
        (end("h", "n"), end("h2", "n"), SAME, r"'h' tensor\(float\) \['n'\] is not allowed"),
        (end("h", "n", 0), end("h2", "n", 0), SAME, r"'h' tensor\(float\) \['n', 0\] is not allowed"),
        (
            end("h", "n", 3, kind=N_INT), end("h2", "n", 3, kind=N_INT), SAME,
            r"'h' tensor\(int64\) \['n', 3\] is not allowed; .* is a tensor\(float\)",
        ),
        (end("h", "n", WIDE), end("h2", "n", WIDE), SAME, r"keeps 16,385 numbers for each agent; at most 16,384"),
    ],
)  # fmt: skip
def test_inputs_and_outputs_that_are_no_pairs_are_refused(given, returned, node, message, tmp_path):
    node = helper.make_node("Relu", ["a"], ["h2"]) if node == "a" else node
    path = save(
        tmp_path / "p.onnx",
        [helper.make_node("Relu", ["a"], ["b"]), *([node] if node else [])],
        [end("a", "n", 2), *([given] if given else [])],
        [end("b", "n", 2), *([returned] if returned else [])],
    )
    with pytest.raises(ParameterError, match=rf"Learned.policy = '.*p.onnx': .*{message}"):
        Policy(path)


def test_memory_that_returns_in_another_size_or_depends_on_other_rows_is_refused(tmp_path):
    for node, message in (
        (helper.make_node("Compress", ["h", "some"], ["h2"], axis=1), r"'h2' returns \(64, 2\), .*\(64, 3\)"),
        (helper.make_node("CumSum", ["h", "axis"], ["h2"]), "outputs of a row depend on other rows"),
        (helper.make_node("RandomNormalLike", ["h"], ["h2"]), "outputs of a row depend on .*chance"),
    ):
        path = save(
            tmp_path / "p.onnx",
            [helper.make_node("Relu", ["a"], ["b"]), node],
            [end("a", "n", 2), end("h", "n", 3)],
            [end("b", "n", 2), end("h2", "n", "any")],
            {"axis": np.array(0), "some": np.array([True, False, True])},
        )
        with pytest.raises(ParameterError, match=message):
            Policy(path)


def test_a_file_that_is_replaced_keeps_as_many_numbers(tmp_path):
    def replace(n_kept):
        counting_policy(tmp_path / "new.onnx", "tussle/RLSimple-v0", 2, 2, n_kept)
        (tmp_path / "new.onnx").replace(tmp_path / "p.onnx")

    replace(3)
    with Simulation(solo(tmp_path / "p.onnx")) as simulation:
        simulation.step(1)
        replace(3)
        simulation.step(1)
        assert simulation.read("robot.Learned.memory")[0].ravel().tolist() == [2.0, 2.0, 2.0]
        replace(4)
        with pytest.raises(
            PluginError, match=r"p.onnx' was replaced by one that keeps .* 4 instead of 3; make"
        ):
            simulation.step(1)


def test_memory_that_is_no_number_ends_its_world(tmp_path):
    nodes = [
        helper.make_node("Relu", ["a"], ["b"]),
        helper.make_node("Add", ["h", "huge"], ["h2"]),
    ]
    path = save(
        tmp_path / "p.onnx",
        nodes,
        [end("a", "n", 2), end("h", "n", 1)],
        [end("b", "n", 2), end("h2", "n", 1)],
        {"huge": np.full(1, 2e38, np.float32)},
        "tussle/RLSimple-v0",
    )
    with Simulation(solo(path)) as simulation:
        simulation.step(1)
        assert simulation.read("robot.Learned.memory")[0].ravel() == np.float32(2e38)
        with pytest.raises(PluginError, match=r"p.onnx keeps a value that is not a finite number"):
            simulation.step(1)

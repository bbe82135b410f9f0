"""Policies as ONNX files: written from arrays of weights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.errors import MissingExtraError, ParameterError, RecordError, listed
from tussle.folders import whole_file

TASK_KEY = "tussle.task"
"""Name of the task in the metadata of a policy's file."""
ACTIVATIONS = ("Tanh", "Relu", "Sigmoid", "Elu")


@contextmanager
def kept_file(path: Path) -> Iterator[Path]:
    """`whole_file` for what training and leagues keep.

    Raises:
        RecordError: The file cannot be written.
    """
    try:
        with whole_file(path) as part:
            yield part
    except OSError as error:
        raise RecordError(f"{path}: cannot be written: {error.strerror or error}") from error


@explained
def write_policy(
    path: str | Path, layers: Sequence[tuple[Any, ...]], *, task: str = "", activation: str = "Tanh"
) -> None:
    """Write a linear policy or a multilayer perceptron as ONNX, for the autonomy `Learned`; with a recurrent layer it has memory.

    Args:
        path: The file.
        layers: Weights (outputs, inputs) and biases (outputs,) of each layer; the activation is between two layers. Or the four parameters
            of a `torch.nn.GRUCell` in their order, weight_ih, weight_hh, bias_ih and bias_hh; no activation follows it.
        task: Registered id of the task it plays, "tussle/PredatorTeam-v0".
        activation: "Tanh", "Relu", "Sigmoid" or "Elu".

    Raises:
        MissingExtraError: The package onnx is not installed.
        ParameterError: The shapes do not fit together, or the activation is unknown.
        RecordError: The file cannot be written.
    """
    try:
        from onnx import TensorProto, helper, numpy_helper, save_model
    except ImportError:
        raise MissingExtraError("write_policy needs onnx: pip install 'tussle[train]'") from None
    if activation not in ACTIVATIONS:
        raise ParameterError(
            f"write_policy: activation = {activation!r} is not allowed; {listed(ACTIVATIONS)}"
        )
    try:
        arrays = [[np.asarray(each, np.float32) for each in layer] for layer in layers]
    except (TypeError, ValueError) as error:
        raise ParameterError(f"write_policy: layers are no arrays of numbers: {error}") from None
    sizes = [_size(layer) for layer in arrays]
    if not sizes or (0, 0) in sizes or any(after[1] != before[0] for before, after in pairwise(sizes)):
        shapes = [tuple(each.shape for each in layer) for layer in arrays]
        raise ParameterError(
            f"write_policy: arrays of the shapes {shapes!s:.300} do not fit; a layer has weights (outputs, inputs) and biases "
            "(outputs,), or the four arrays of a GRUCell, the inputs being the outputs of the layer before"
        )
    nodes, name = [], "observation"
    tensors: dict[str, np.ndarray] = {}
    ends: list[tuple[str, list[Any]]] = [
        ("observation", ["agents", sizes[0][1]]),
        ("action", ["agents", sizes[-1][0]]),
    ]
    for i, layer in enumerate(arrays):
        is_last = i == len(arrays) - 1
        out, weight, bias = "action" if is_last else f"sum{i}", f"weight{i}", f"bias{i}"
        if len(layer) == 2:
            tensors |= {weight: layer[0], bias: layer[1]}
            nodes.append(helper.make_node("Gemm", [name, weight, bias], [out], transB=1))
            if not is_last:
                name = f"layer{i}"
                nodes.append(helper.make_node(activation, [out], [name]))
        else:
            n, before, after = sizes[i][0], f"memory{i}", f"next_memory{i}"
            w_in, w_kept, *biases = (
                each.reshape(3, n, -1)[[1, 0, 2]].reshape(1, *each.shape) for each in layer
            )
            tensors |= {
                "first": np.array([0]),
                weight: w_in,
                f"recurrent{i}": w_kept,
                bias: np.concatenate(biases, 1),
            }
            nodes += [
                helper.make_node("Unsqueeze", [name, "first"], [f"row{i}"]),
                helper.make_node(
                    "GRU",
                    [f"row{i}", weight, f"recurrent{i}", bias, "", before],
                    ["", after],
                    hidden_size=n,
                    linear_before_reset=1,
                ),
                helper.make_node("Squeeze", [after, "first"], [out]),
            ]
            ends += [(before, [1, "agents", n]), (after, [1, "agents", n])]
            name = out
    found = [helper.make_tensor_value_info(end, TensorProto.FLOAT, shape) for end, shape in ends]
    kept = [numpy_helper.from_array(array, key) for key, array in tensors.items()]
    graph = helper.make_graph(nodes, "policy", found[::2], found[1::2], kept)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {TASK_KEY: task} if task else {})
    with kept_file(Path(path)) as part:
        save_model(model, str(part), format="protobuf")


def _size(layer: list[np.ndarray]) -> tuple[int, int]:
    """Numbers of outputs and inputs of a layer; 0 and 0 if its arrays do not fit together."""
    weight, n = layer[0] if layer else np.empty(0), len(layer[-1]) if layer and layer[-1].ndim else 0
    if weight.ndim != 2:
        return 0, 0
    expected = {2: [(n, weight.shape[1]), (n,)], 4: [(n, weight.shape[1]), (n, n // 3), (n,), (n,)]}
    fits = [each.shape for each in layer] == expected.get(len(layer)) and (len(layer) == 2 or n % 3 == 0)
    return (n if len(layer) == 2 else n // 3, weight.shape[1]) if fits else (0, 0)


__all__ = ["ACTIVATIONS", "TASK_KEY", "kept_file", "write_policy"]

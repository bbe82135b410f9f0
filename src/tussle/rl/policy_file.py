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
    path: str | Path, layers: Sequence[tuple[Any, Any]], *, task: str = "", activation: str = "Tanh"
) -> None:
    """Write a linear policy or a multilayer perceptron as ONNX, for the autonomy `Learned`.

    Args:
        path: The file.
        layers: Weights (outputs, inputs) and biases (outputs,) of each layer; the activation is between two layers.
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
        arrays = [(np.asarray(w, np.float32), np.asarray(b, np.float32)) for w, b in layers]
    except ValueError as error:
        raise ParameterError(f"write_policy: layers are no arrays of numbers: {error}") from None
    shapes = [w.shape for w, _ in arrays]
    if (
        not arrays
        or any(w.ndim != 2 or b.shape != w.shape[:1] for w, b in arrays)
        or any(after[1] != before[0] for before, after in pairwise(shapes))
    ):
        raise ParameterError(
            f"write_policy: weights {shapes} and biases {[b.shape for _, b in arrays]} do not fit; they are (outputs, inputs) and "
            "(outputs,), the inputs being the outputs of the layer before"
        )
    nodes, tensors, name = [], [], "observation"
    for i, (weight, bias) in enumerate(arrays):
        is_last = i == len(arrays) - 1
        tensors += [numpy_helper.from_array(weight, f"weight{i}"), numpy_helper.from_array(bias, f"bias{i}")]
        out = "action" if is_last else f"sum{i}"
        nodes.append(helper.make_node("Gemm", [name, f"weight{i}", f"bias{i}"], [out], transB=1))
        if not is_last:
            name = f"layer{i}"
            nodes.append(helper.make_node(activation, [out], [name]))
    ends = [
        helper.make_tensor_value_info(end, TensorProto.FLOAT, ["agents", width])
        for end, width in (("observation", shapes[0][1]), ("action", shapes[-1][0]))
    ]
    graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {TASK_KEY: task} if task else {})
    with kept_file(Path(path)) as part:
        save_model(model, str(part), format="protobuf")


__all__ = ["ACTIVATIONS", "TASK_KEY", "kept_file", "write_policy"]

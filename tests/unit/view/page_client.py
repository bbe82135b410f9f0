"""Speaks to the page as a browser does, without drawing: viser's protocol over a websocket."""

from __future__ import annotations

import threading
import time
from collections import Counter
from importlib import import_module

import numpy as np

# They come with viser, which is why they are not dependencies of their own.
connect = import_module("websockets.sync.client").connect
msgpack = import_module("msgspec.msgpack")
zstandard = import_module("zstandard")


class PageClient:
    """A browser without a picture: keeps what the server says of the scene and the panel, and clicks what is asked for.

    Args:
        url: Of the page.
        is_reading: Take what the server sends; without, it is a browser that hangs.

    Attributes:
        nodes: Name of a node of the scene -> its properties.
        inputs: Id of an element of the panel -> its properties, "value" among them.
        commands: Id of a command -> its properties.
        camera: Last position and target that the server has asked for.
        n_frames: Batches in which entities were moved.
        n_bytes: All that was received.
        kinds: Type of a message -> how many were received.
    """

    def __init__(self, url: str, *, is_reading: bool = True) -> None:
        viser = import_module("viser")
        self.nodes: dict[str, dict] = {}
        self.inputs: dict[str, dict] = {}
        self.commands: dict[str, dict] = {}
        self.camera: dict[str, tuple] = {}
        self.notifications: list[dict] = []
        self.n_frames = self.n_bytes = 0
        self.kinds: Counter[str] = Counter()
        self.error: Exception | None = None
        self._socket = connect(
            url.replace("http", "ws", 1), subprotocols=[f"viser-v{viser.__version__}"], max_size=None,
            compression=None, open_timeout=300, max_queue=16,
        )  # fmt: skip
        self.send_camera((0.0, -100.0, 50.0), (0.0, 0.0, 0.0))
        self._thread = threading.Thread(target=self._read, daemon=True)
        if is_reading:
            self._thread.start()

    def send_camera(self, position: tuple, target: tuple) -> None:
        """Say where the camera is: the first of these makes a connection a client."""
        self.send(
            "ViewerCameraMessage", wxyz=(1.0, 0.0, 0.0, 0.0), position=position, fov=0.9, near=0.1, far=1e4,
            image_height=400, image_width=600, look_at=target, up_direction=(0.0, 0.0, 1.0),
        )  # fmt: skip

    def send(self, kind: str, **fields) -> None:
        self._socket.send(msgpack.encode({"type": kind, **fields}))

    def close(self) -> None:
        self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        self.close()

    # -- what the server says -------------------------------------------------------------------------------------------------------

    def _read(self) -> None:
        try:
            for raw in self._socket:
                self._take(raw)
        except Exception as error:  # noqa: BLE001 - a closed connection among them
            self.error = error

    def _take(self, raw: bytes) -> None:
        self.n_bytes += len(raw)
        n = int.from_bytes(raw[8:16], "little")
        packed = msgpack.decode(zstandard.ZstdDecompressor().decompress(raw[16 : 16 + n]))
        place, arrays = 16 + n, []
        for length in packed["binaryBufferLengths"]:
            place += -place % 8
            arrays.append(raw[place : place + length])
            place += length
        moved = False
        for message in packed["messages"]:
            moved |= self._note(_filled(message, arrays))
        self.n_frames += moved

    def _note(self, message: dict) -> bool:
        kind, name = message["type"], message.get("name", "")
        self.kinds[kind] += 1
        if kind == "SceneNodeUpdateMessage":
            self.nodes.setdefault(name, {}).update(message["updates"])
            return name.startswith("/entities") and "batched_positions" in message["updates"]
        if kind == "GuiUpdateMessage":
            self.inputs.setdefault(message["uuid"], {}).update(message["updates"])
        elif kind == "RegisterCommandMessage":
            self.commands[message["uuid"]] = message["props"]
        elif kind == "RemoveSceneNodeMessage":
            self.nodes.pop(name, None)
        elif kind == "SetSceneNodeVisibilityMessage":
            self.nodes.setdefault(name, {})["visible"] = message["visible"]
        elif kind == "SetPositionMessage":
            self.nodes.setdefault(name, {})["position"] = message["position"]
        elif kind in ("SetCameraPositionMessage", "SetCameraLookAtMessage") and not message.get("initial"):
            self.camera["position" if "Position" in kind else "target"] = (
                message.get("position") or message["look_at"]
            )
        elif kind == "NotificationShowMessage":
            self.notifications.append(message["props"])
        elif kind.startswith("Gui") and "props" in message:
            self.inputs[message["uuid"]] = {**message["props"], "value": message.get("value")}
        elif "props" in message and name:
            self.nodes[name] = message["props"]
        return False

    # -- what somebody does -----------------------------------------------------------------------------------------------------------

    def wait(self, condition, timeout: float = 300.0):
        """Wait until it holds, and return what it gave."""
        until = time.monotonic() + timeout
        while not (given := condition()):
            assert time.monotonic() < until, "it does not come"
            time.sleep(0.01)
        return given

    def id_of(self, label: str) -> str:
        """Id of an element of the panel, once it is there."""
        return self.wait(
            lambda: next((k for k, v in list(self.inputs.items()) if v.get("label") == label), None)
        )

    def value(self, label: str):
        return self.inputs[self.id_of(label)]["value"]

    def set(self, label: str, value) -> None:
        """Set an element, or press the button of a group that is called so."""
        self.send("GuiUpdateMessage", uuid=self.id_of(label), updates={"value": value})

    def text(self, part: str) -> str:
        """The HTML or Markdown of the panel that holds this part; "" without one."""
        for element in list(self.inputs.values()):
            for key in ("content", "_markdown"):
                if part in (element.get(key) or ""):
                    return element[key]
        return ""

    def press(self, label: str) -> None:
        """Press a key, called as its help calls it."""
        key = self.wait(
            lambda: next((k for k, v in list(self.commands.items()) if v["description"] == label), None)
        )
        self.send("CommandTriggerMessage", uuid=key)

    def click(self, node: str, instance: int) -> None:
        """Click one of a batch of meshes."""
        self.wait(lambda: node in self.nodes)
        self.send(
            "SceneNodeClickMessage", name=node, instance_index=instance, ray_origin=(0.0, 0.0, 0.0),
            ray_direction=(1.0, 0.0, 0.0), screen_pos=(0.5, 0.5), modifier=None, owner="",
        )  # fmt: skip

    def click_ground(self, origin: tuple, direction: tuple) -> None:
        """Click into the scene, along a ray."""
        self.send(
            "ScenePointerMessage", event_type="click", ray_origin=origin, ray_direction=direction,
            screen_pos=((0.5, 0.5),), modifier=None,
        )  # fmt: skip

    def positions(self, model: str) -> np.ndarray:
        """Where the entities of a model are drawn [m], (n, 3)."""
        return np.frombuffer(self.nodes[f"/entities/{model}"]["batched_positions"], np.float32).reshape(-1, 3)


def _filled(value, arrays: list[bytes]):
    """A message with its arrays in place, as bytes."""
    if isinstance(value, dict):
        if "__binary_index" in value:
            return arrays[value["__binary_index"]]
        return {key: _filled(item, arrays) for key, item in value.items()}
    return [_filled(item, arrays) for item in value] if isinstance(value, list) else value

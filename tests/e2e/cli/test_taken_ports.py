"""Ports that another program holds are named, by whatever part of a mission or command opens them, with the code of a wrong input."""

import socket

import pytest

MISSION = """<runscript><run dt="0.004" end="1"/>
{interaction}
<latitude_origin>35</latitude_origin><longitude_origin>-120</longitude_origin><altitude_origin>0</altitude_origin>
<entity><name>a</name><team_id>1</team_id><count>1</count>{autonomy}</entity>
<entity><name>guest</name><team_id>2</team_id><count>0</count></entity></runscript>"""
MULTIROTOR = "<controller>DirectController</controller><motion_model>Multirotor</motion_model>"
MOTORS = " ".join(f"[ motor_{i} {i} 1000 2000 346 1200 1 ]" for i in range(4))
OPENED = {
    "DIS": (
        socket.SOCK_DGRAM,
        {"interaction": '<entity_interaction listen_port="{}" listen_address="127.0.0.1" address="127.0.0.1" remote="guest">DIS'},
        "listen_port: 127.0.0.1:{}",
    ),
    "GRPCCommandString": (
        socket.SOCK_STREAM,
        {"interaction": '<entity_interaction port="{}" ip="127.0.0.1">GRPCCommandString'},
        "port: 127.0.0.1:{}",
    ),
    "GRPCCommandString of a name": (
        socket.SOCK_STREAM,
        {"interaction": '<entity_interaction port="{}">GRPCCommandString'},
        "port: localhost:{}",
    ),
    "PX4": (
        socket.SOCK_STREAM,
        {"autonomy": '<autonomy port="{}">PX4</autonomy>' + MULTIROTOR},
        "port: 127.0.0.1:{}",
    ),
    "ArduPilot": (
        socket.SOCK_DGRAM,
        {"autonomy": '<autonomy protocol="json" json_port="{}" servo_map="' + MOTORS + '">ArduPilot</autonomy>' + MULTIROTOR},
        "json_port: 127.0.0.1:{}",
    ),
}  # fmt: skip
NEEDED = {"GRPCCommandString": "grpc", "PX4": "pymavlink"}


@pytest.mark.parametrize("name", OPENED)
def test_a_port_that_another_program_holds_on_ipv4_alone_is_named(tussle, folder, name):
    kind, parts, what = OPENED[name]
    if needed := NEEDED.get(name.partition(" ")[0]):
        pytest.importorskip(needed)
    with socket.socket(socket.AF_INET, kind) as other:
        other.bind(("127.0.0.1", 0))
        if kind == socket.SOCK_STREAM:
            other.listen()
        port = other.getsockname()[1]
        filled = {part: text.format(port) for part, text in parts.items()}
        if "interaction" in filled:
            filled["interaction"] += "</entity_interaction>"
        (folder / "m.xml").write_text(MISSION.format(**{"interaction": "", "autonomy": "", **filled}))
        done = tussle("run", "m.xml", "--no-log", code=1)
    assert f"{what.format(port)} cannot be opened: Address already in use" in done.stderr, done.stderr


@pytest.mark.parametrize("command", ["serve", "view"])
def test_a_page_or_server_names_it_with_the_same_code(tussle, command):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = tussle(command, "game.xml", "--port", port, code=1)
    assert f"port {port}: " in done.stderr
    assert "Address already in use" in done.stderr

"""The domain of ROS 2: its number, and a participant of Cyclone DDS that nobody outside this machine can reach."""

from __future__ import annotations

import ctypes
import os
import socket
import threading
from pathlib import Path
from typing import Any

from tussle.documents import is_count
from tussle.errors import RosError

LAST_DOMAIN, FIRST_PORT, N_PORTS = 232, 7400, 250
"""Highest ROS_DOMAIN_ID, first port of domain 0, ports of a domain (DDSI-RTPS 2.5, 9.6.2.3)."""
CONFIG = "CYCLONEDDS_URI"
LOOPBACK = """<CycloneDDS><Domain id="any">
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
"""Configuration of Cyclone DDS where the user has none: nobody outside this machine can command a robot."""
LOOPBACK_NAME = b"lo"
_environment = threading.Lock()


def domain_id() -> int:
    """The number of the domain, from the environment; 0 by default.

    Raises:
        RosError: It is no number of a domain.
    """
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not (is_count(text) and int(text) <= LAST_DOMAIN):
        raise RosError(
            f"ROS_DOMAIN_ID = {text!r} is not allowed; it takes a whole number from 0 to {LAST_DOMAIN}"
        )
    return int(text)


def opened_participant() -> Any:
    """A participant in the domain of the environment, on the loopback interface unless the user has configured Cyclone DDS.

    Raises:
        RosError: The domain cannot be joined.
    """
    from cyclonedds.core import DDSException
    from cyclonedds.domain import DomainParticipant

    domain = domain_id()
    with _environment:
        # A domain reads its configuration from the environment when its first participant comes, and ends with the last one.
        is_ours = not os.environ.get(CONFIG)
        if is_ours:
            os.environ[CONFIG] = LOOPBACK
        try:
            participant = DomainParticipant(domain)
            if is_ours and (fault := _bind_to_loopback(FIRST_PORT + N_PORTS * domain)):
                del participant  # the error would keep it
                raise RosError(fault)
            return participant
        except DDSException as error:
            given = "" if is_ours else f" as {CONFIG} = {os.environ[CONFIG]!r} says"
            raise RosError(f"the domain {domain} of ROS 2 cannot be joined{given}: {error}") from None
        finally:
            if is_ours:
                del os.environ[CONFIG]


def _bind_to_loopback(first_port: int) -> str:
    """Let the sockets that Cyclone DDS has opened for a domain receive packets of this machine only; returns what prevents it.

    It binds them to all interfaces, whatever its configuration says (its issue 2090). Not by Python's sockets, which may change whether a
    socket blocks.
    """
    names = _sockets_on_all_interfaces(range(first_port, first_port + N_PORTS))
    for path in Path("/proc/self/fd").iterdir():
        try:
            is_ours = str(path.readlink()) in names
        except OSError:  # that of the listing, or another thread has closed it
            continue
        if is_ours and (error := _bind_socket_to_loopback(int(path.name))):
            return (
                f"Cyclone DDS listens on all interfaces, and cannot be bound to the loopback interface: {os.strerror(error)}; "
                f"set {CONFIG} if that is wanted"
            )
    return ""


def _sockets_on_all_interfaces(ports: range) -> set[str]:
    """UDP sockets bound to no address, as /proc/self/fd names them."""
    found = set()
    for line in Path("/proc/self/net/udp").read_text(encoding="ascii").splitlines()[1:]:
        fields = line.split()
        address, _, port = fields[1].partition(":")
        if int(address, 16) == 0 and int(port, 16) in ports:
            found.add(f"socket:[{fields[9]}]")
    return found


def _bind_socket_to_loopback(number: int) -> int:
    """Bind a socket, given by its file's number, to the loopback interface; returns the number of the error, or 0."""
    libc = ctypes.CDLL(None, use_errno=True)
    option, name, size = (socket.SOL_SOCKET, socket.SO_BINDTODEVICE), ctypes.create_string_buffer(16), 16
    libc.getsockopt(number, *option, name, ctypes.byref(ctypes.c_uint32(size)))
    # A second time is not allowed to everybody.
    if name.value != LOOPBACK_NAME and libc.setsockopt(number, *option, LOOPBACK_NAME, len(LOOPBACK_NAME)):
        return ctypes.get_errno()
    return 0

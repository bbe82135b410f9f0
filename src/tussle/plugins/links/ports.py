"""Ports of this machine that plugins open."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tussle.errors import PortError


@contextmanager
def opening(what: str, host: str, port: int) -> Iterator[None]:
    """Open a port within.

    Args:
        what: Parameter that names the port.
        host: Address of the port, as the user named it.
        port: The port.

    Raises:
        PortError: The system has refused it.
    """
    try:
        yield
    except OSError as error:
        raise PortError(f"{what}: {host}:{port} cannot be opened: {error.strerror or error}") from None

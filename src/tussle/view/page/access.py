"""Access control of the page: token in the address, allowed host names, no foreign origins."""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

from tussle.errors import ParameterError, ViewError, listed
from tussle.record.inputs import check_giver

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104 - they are compared, not bound
TOKEN_BYTES = 16
MAX_BROWSERS = 32
"""Largest number of connected browsers."""
MAX_BYTES = 16 * 1024
"""Largest size of a message from a browser [B]; controls send some hundred."""
MAX_UNSENT = 64 * 1024
"""Number of unsent bytes at which sending to a browser pauses."""
PORT = 8123
"""Default port; if it is taken, the next free one is used."""
MAX_PORTS = 100
HEADERS = {
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""Headers of each answer: browsers pass the address to nobody, and no other page embeds this one."""


DIRECT, OPERATE, WATCH = "direct", "operate", "watch"


@dataclass(frozen=True)
class PageRole:
    """What somebody who has an address may do.

    Attributes:
        kind: "direct": everything; "operate": give orders to the entities of a team; "watch": nothing that changes the game or its time.
        team: The team, of an operator.
        name: Who has the address, of an operator; "" where anybody may have it.
    """

    kind: str = DIRECT
    team: int | None = None
    name: str = ""

    def __str__(self) -> str:
        role = self.kind if self.team is None else f"{self.kind} team {self.team}"
        return f"{self.name} ({role})" if self.name else role

    @classmethod
    def of_operator(cls, text: str) -> Self | None:
        """The role that has this text, of an operator; None for any other text."""
        found = re.fullmatch(r"(?:(.+) \()?operate team (-?\d+)(?(1)\))", text)
        return cls(OPERATE, int(found[2]), found[1] or "") if found else None


def operator_roles(operators: Mapping[str, int], teams: Collection[int]) -> list[PageRole]:
    """The roles of people who operate a team each.

    Args:
        operators: Name -> team.
        teams: Teams of the game.

    Raises:
        ParameterError: A name is not allowed or looks like another one, or there is no such team.
    """
    roles: dict[str, PageRole] = {}
    for name, team in operators.items():
        check_giver("operator", name)
        if not name or name != name.strip():
            raise ParameterError(f"operator: {name!r} is not allowed; a name has no space at its ends")
        if team not in list(teams):
            raise ParameterError(
                f"operator: {name!r} cannot operate team {team!r}; {listed(map(str, sorted(teams)))}"
            )
        role = PageRole(OPERATE, int(team), name)
        check_giver("operator", str(role))
        looks = unicodedata.normalize("NFKC", name).casefold()
        if looks in roles:
            raise ParameterError(f"operator: {name!r} and {roles[looks].name!r} look alike")
        roles[looks] = role
    return list(roles.values())


class Access:
    """Decides which requests for the page and its socket are answered, and what they may do.

    Args:
        host: Address that the page is served at.
        port: Its port.
        roles: Roles besides the one that may do everything; each has an address of its own.

    Attributes:
        token: Secret part of the address of who may do everything.
        url: This address.
        addresses: Role -> its address.
    """

    def __init__(self, host: str, port: int, roles: Sequence[PageRole] = ()) -> None:
        self._roles = {secrets.token_hex(TOKEN_BYTES): role for role in (PageRole(), *roles)}
        self.token = next(iter(self._roles))
        self._port = port
        self._is_everywhere = host in EVERYWHERE
        name = "127.0.0.1" if self._is_everywhere else f"[{host}]" if ":" in host else host.lower()
        self._names = {*LOOPBACK_NAMES, name}
        self.addresses = {role: f"http://{name}:{port}/{token}" for token, role in self._roles.items()}
        self.url = self.addresses[PageRole()]

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> str:
        """Return why a request is refused; "" if it is accepted.

        Args:
            path: The path that is asked for.
            hosts: Values of all its Host headers. A name that somebody else has bound to this machine's address is not served.
            origins: Values of all its Origin headers. Browsers name the page there that asks; without one it is no other page.
        """
        if len(hosts) != 1 or not self._is_served(hosts[0]):
            return f"This page is served at port {self._port} of this machine's own addresses only.\n"
        if list(origins) not in ([], [f"http://{hosts[0]}"]):
            return "This page is not open to other pages.\n"
        if self.role_of(path) is None:
            return "The address is not complete: take all of it from where tussle was started.\n"
        return ""

    def role_of(self, path: str) -> PageRole | None:
        """Return the role of who asks for a path; None without the secret part of an address."""
        token = path.removeprefix("/").partition("?")[0].partition("/")[0].encode(errors="replace")
        found = None
        for known, role in self._roles.items():  # all of them: the time tells nothing
            if hmac.compare_digest(token, known.encode()):
                found = role
        return found

    def _is_served(self, host: str) -> bool:
        name, _, port = host.lower().rpartition(":")
        if port != str(self._port):
            return False
        return name in self._names or (self._is_everywhere and _is_own(name))


def _is_own(name: str) -> bool:
    """Return whether a host is an IP address, which no name server can redirect, or the name of this machine."""
    try:
        ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return name == socket.gethostname().lower()
    return True


def bound_socket(host: str, wanted: int | None) -> socket.socket:
    """Return a socket bound to the requested port, or to the first free one.

    Raises:
        ViewError: There is none, the one that is wanted is taken, or the host is not this machine's.
    """
    ports = [wanted] if wanted is not None else list(range(PORT, PORT + MAX_PORTS))
    refusal: OSError | None = None
    for port in ports:
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            bound = socket.socket(family, kind, protocol)
        except OSError as error:
            refusal = error
            break
        try:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            bound.bind(address)
            bound.listen()
        except OSError as error:
            refusal = error
            bound.close()
        else:
            return bound
    where = f"port {wanted}" if wanted is not None else f"ports {PORT} to {PORT + MAX_PORTS - 1}"
    raise ViewError(f"the page cannot be served at {host}, {where}: {refusal}")

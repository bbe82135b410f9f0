"""A simulation as a server for programs in any language: see docs/serve.md."""

from tussle.view.serve.server import Server
from tussle.view.serve.session import Session

__all__ = ["Server", "Session"]

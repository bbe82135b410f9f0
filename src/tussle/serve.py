"""Simulations as servers."""

from tussle.view.serve import Server, Session

__all__ = ["Server", "Session"]
__path__: list[str] = []  # former modules are found by tussle.former_names

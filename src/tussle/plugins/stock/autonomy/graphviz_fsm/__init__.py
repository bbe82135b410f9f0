"""GraphvizFSM: a finite state machine given as a graph."""

from tussle.plugins.stock.autonomy.graphviz_fsm.plugin import GraphvizFSM

__all__ = ["GraphvizFSM"]

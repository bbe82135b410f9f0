"""Plots of a recorded run: ways, speed, altitude, distance, who is left, captures, where they were.

Each is a function of the chosen part of a recording that gives a Matplotlib figure; `plot_style` is to be around it. `write_plots`
writes several into files.
"""

from tussle.view.plots.columns import column, column_of_runs, runs_of
from tussle.view.plots.counts import captures, left
from tussle.view.plots.curves import altitude, distance, speed
from tussle.view.plots.files import KINDS, Plots, write_plots
from tussle.view.plots.maps import density, trajectory, trajectory3d
from tussle.view.plots.selection import Selection, Trajectories
from tussle.view.plots.sheet import FORMATS, plot_style

__all__ = [
    "FORMATS",
    "KINDS",
    "Plots",
    "Selection",
    "Trajectories",
    "altitude",
    "captures",
    "column",
    "column_of_runs",
    "density",
    "distance",
    "left",
    "plot_style",
    "runs_of",
    "speed",
    "trajectory",
    "trajectory3d",
    "write_plots",
]

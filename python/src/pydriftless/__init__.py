"""Planar mechanisms over long horizons, with constraint stabilization and error estimates.

>>> import pydriftless as dl
>>> scene = dl.load("examples/scenes/free.json")  # doctest: +SKIP
>>> run = scene.run(until=10, method="taylor")    # doctest: +SKIP
>>> run["bar2"].phi, run.trust.horizon            # doctest: +SKIP

Units are SI throughout, angles in radians, absolute, from +x, counter-clockwise.
"""

from ._builder import Builder, ground, on
from ._core import DriftlessError, Interrupted, RequestRefused, SceneRefused, __version__
from ._report import Picture, Report
from ._run import Columns, Event, Run, resume
from ._scene import Scene, load, loads
from ._sweep import Sweep
from ._trace import State, Symbol, where

__all__ = [
    "Builder",
    "Columns",
    "DriftlessError",
    "Event",
    "Interrupted",
    "Picture",
    "Report",
    "RequestRefused",
    "Run",
    "Scene",
    "SceneRefused",
    "State",
    "Sweep",
    "Symbol",
    "__version__",
    "ground",
    "load",
    "loads",
    "on",
    "resume",
    "where",
]

"""What a run came to."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._report import Picture

if TYPE_CHECKING:
    from ._scene import Scene


class Columns(Mapping[str, np.ndarray]):
    """Columns of one part: ``run["bar2"].phi`` is ``run["bar2.phi"]``."""

    def __init__(self, columns: dict[str, np.ndarray]) -> None:
        self._columns = columns

    def __getattr__(self, name: str) -> np.ndarray:
        # Copies and pickles ask before there is anything.
        columns: dict[str, np.ndarray] = self.__dict__.get("_columns", {})
        try:
            return columns[name]
        except KeyError:
            raise AttributeError(f"there is no {name!r}; there are {', '.join(columns)}") from None

    def __getitem__(self, name: str) -> np.ndarray:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._columns]

    def __repr__(self) -> str:
        return f"<Columns: {', '.join(self._columns)}>"


class Run:
    """A run and its trajectory, in the manner of ``scipy.integrate``.

    All columns are views of one block of numbers.

    Attributes
    ----------
    rows : numpy.ndarray
        The trajectory, shape (rows, columns).
    columns : list of str
        Names of its columns without their units.
    units : dict
        Units by the names of the columns.
    t : numpy.ndarray
        Output times [s].
    success : bool
        Whether it came to its horizon.
    message : str
        How it ended.
    report : dict
        What ``run.json`` of the program holds.
    """

    def __init__(
        self, raw: _core.Raw, scene: Scene, described: list[Any] | None = None
    ) -> None:
        self._raw = raw
        self._described = described or []
        self.scene = scene
        self.rows: np.ndarray = raw.rows
        heads = [head.partition(" [") for head in scene.columns]
        self.columns: list[str] = [name for name, _, _ in heads]
        self.units: dict[str, str] = {name: unit.rstrip("]") for name, _, unit in heads}

    @property
    def t(self) -> np.ndarray:
        """Output times [s]."""
        times: np.ndarray = self.rows[:, 0]
        return times

    @property
    def success(self) -> bool:
        """Whether it came to its horizon, or was ended by an event or the callback."""
        return self._raw.stop is None

    @property
    def message(self) -> str:
        """How it ended."""
        if self._raw.stop is not None:
            return self._raw.stop
        by = {None: "the horizon was reached", "observer": "ended by the callback"}
        return by.get(self._raw.ended_by, f"ended by the event {self._raw.ended_by}")

    @cached_property
    def report(self) -> dict[str, Any]:
        """What ``run.json`` of the program holds."""
        report: dict[str, Any] = json.loads(self._raw.report())
        return report

    @property
    def energy_drift(self) -> float:
        """Largest energy drift over the energy scale."""
        return float(self.report["result"]["energy"]["max_relative"])

    @property
    def trust(self) -> SimpleNamespace:
        """The error estimate: ``horizon`` and ``error`` among what ``report["result"]["trust"]`` has."""
        found = self.report["result"]["trust"] or {}
        return SimpleNamespace(
            **{**found, "horizon": found.get("horizon_s"), "error": found.get("error_estimate")}
        )

    @property
    def events(self) -> list[dict[str, Any]]:
        """Events in their order: ``name``, ``t``, ``phi`` and ``omega``."""
        return self._raw.events()

    @property
    def motors(self) -> dict[str, Columns]:
        """Torques [N m] or forces [N] and powers [W] of the motors."""
        names = [name[: -len(".power")] for name in self.columns if name.endswith(".power")]
        return {name: self[name] for name in names}

    def __getitem__(self, name: str) -> Any:
        if name in self.units:
            return self.rows[:, self.columns.index(name)]
        part = {
            column[len(name) + 1 :]: self.rows[:, k]
            for k, column in enumerate(self.columns)
            if column.startswith(name + ".")
        }
        if not part:
            raise KeyError(f"there is no column or part {name!r}; there are {', '.join(self.columns)}")
        return Columns(part)

    def __call__(self, t: Any) -> SimpleNamespace:
        """Angles and rates at times within the run, by the dense output of its method.

        Returns
        -------
        namespace
            ``phi`` and ``omega``, arrays of the shape of ``t`` by the name of each body; of a body that
            floats positions and velocities as well, by ``"ball.x"`` and ``"ball.y"``.
        """
        times = np.asarray(t, dtype=float)
        if (times > self._raw.end).any():
            raise ValueError(f"t = {times.max()} s lies outside of the run, 0 to {self._raw.end} s")
        names = self._raw.coordinates()
        numbers = self._dense.at(times.ravel()).reshape(times.size, 2 * len(names))
        shaped = [numbers[:, k].reshape(times.shape)[()] for k in range(numbers.shape[1])]
        return SimpleNamespace(
            phi=dict(zip(names, shaped[: len(names)])), omega=dict(zip(names, shaped[len(names) :]))
        )

    @cached_property
    def _dense(self) -> Any:
        try:
            self._raw.at(np.empty(0))
            return self._raw
        except ValueError:
            return self._raw.again(self._described)

    @property
    def charts(self) -> list[str]:
        """Names of the charts it has."""
        return self._raw.charts()

    def chart(self, name: str = "mechanism", format: str = "png") -> Picture:
        """A chart of the program: one of ``charts``, as png, svg or pdf; the motion as gif or apng."""
        return Picture(self._raw.chart(name, format), format)

    def animation(self, format: str = "gif") -> Picture:
        """The mechanism in motion, as gif or apng."""
        return self.chart("mechanism", format)

    def to_pandas(self) -> Any:
        """The trajectory as a ``pandas.DataFrame`` over time; ``attrs["units"]`` has the units."""
        import pandas as pd

        frame = pd.DataFrame(self.rows[:, 1:], index=pd.Index(self.t, name="t"), columns=self.columns[1:], copy=False)
        frame.attrs["units"] = self.units
        return frame

    def to_xarray(self) -> Any:
        """The trajectory as an ``xarray.Dataset`` over time, with units."""
        import xarray as xr

        variables = {
            name: ("t", self.rows[:, k], {"units": self.units[name]})
            for k, name in enumerate(self.columns)
            if k > 0
        }
        return xr.Dataset(variables, coords={"t": ("t", self.t, {"units": "s"})}, attrs={"scene": self.scene.name})

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Draw columns against time with matplotlib; by default all angles.

        Returns
        -------
        matplotlib.axes.Axes
        """
        import matplotlib.pyplot as plt

        names = names or tuple(name for name in self.columns if name.endswith(".phi"))
        ax = ax if ax is not None else plt.subplots()[1]
        for name in names:
            ax.plot(self.t, self[name], label=name)
        units = {self.units[name] for name in names}
        ax.set_xlabel("time [s]")
        ax.set_ylabel(f"[{units.pop()}]" if len(units) == 1 else "")
        ax.legend()
        return ax

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        return {"text/plain": repr(self), **self.chart()._repr_mimebundle_()}

    def __repr__(self) -> str:
        method = self.report["result"]["method"]
        end = self.t[-1] if len(self.t) else 0.0
        return f"<Run of {self.scene.name!r} by {method}: {len(self.t)} rows to {end} s; {self.message}>"


@dataclass(frozen=True)
class Event:
    """An event written in Python: slow, but located as exactly as all others.

    Attributes
    ----------
    name : str
        Its name in ``run.events``.
    function : callable
        A smooth function of a moment, never NaN, whose zero is the event: ``lambda at: at.phi("bar2") - 1``.  A moment
        has ``t``, ``phi(body)``, ``omega(body)``, ``position(body, point)`` and ``velocity(body, point)``.
    direction : int
        1 for zeros that are passed upwards, -1 downwards, 0 for both.
    stop : bool
        Whether the run ends there.
    """

    name: str
    function: Callable[[_core.Moment], float]
    direction: int = 0
    stop: bool = False

    def __post_init__(self) -> None:
        """Refuses a direction that is none."""
        if self.direction not in (-1, 0, 1):
            raise ValueError(f"event {self.name}: direction is -1, 0 or 1, not {self.direction!r}")

    def described(self) -> tuple[str, Callable[[_core.Moment], float], int, bool]:
        """As the native part takes it."""
        return self.name, self.function, self.direction, self.stop


def resume(
    checkpoint: bytes | str | Path,
    callback: Callable[[float, np.ndarray], Any] | None = None,
    events: Sequence[Event] = (),
) -> Run:
    """Go on with an interrupted run: it ends as if nothing had been, bit for bit.

    Parameters
    ----------
    checkpoint : bytes or path
        That of :class:`Interrupted`, or a file it was written to.
    callback, events
        As for :meth:`Scene.run`; the events have to be those of the run before.
    """
    from ._scene import Scene

    content = checkpoint if isinstance(checkpoint, bytes) else Path(checkpoint).read_bytes()
    described = [event.described() for event in events]
    raw = _core.resume(content, callback, described)
    return Run(raw, Scene(*raw.scene.parts()), described)

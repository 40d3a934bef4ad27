"""Sweeps: many runs of one scene, here or by whoever takes work."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _core
from ._files import written
from ._progress import progress_bar

if TYPE_CHECKING:
    from ._scene import Scene

STATUS = ("done", "stopped", "refused", "skipped")


class Part(NamedTuple):
    """Points of a sweep that were computed together, as :class:`Sweep` tells them, with their causes in a list."""

    heads: list[str]
    rows: np.ndarray
    flip_bar: np.ndarray
    status: np.ndarray
    causes: list[tuple[int, str]]
    report: str
    bars: list[str]
    first: int


class Sweep:
    """The points of a sweep, a row of numbers each.

    Attributes
    ----------
    rows : numpy.ndarray
        Shape (points, columns): what is varied, then what came of it; not a number where there is nothing.
    columns : list of str
        Names of the columns, without their units.
    units : dict
        Units by the names of the columns.
    flip_bar : numpy.ndarray
        Number of the bar that turned over first, from 0, -1 for none.
    bars : list of str
        Names of the bars by that number.
    status : numpy.ndarray
        0 done, 1 stopped, 2 refused, 3 skipped.
    causes : dict
        Why points stopped or were refused, by their number in the whole sweep.
    first : int
        Number of the first point in the whole sweep: not 0 for a later shard.
    counts : numpy.ndarray
        How many points are done, stopped, refused and skipped, also of those that went to a file.
    grid : tuple of int or None
        Numbers of values, where the points are a whole grid.
    report : dict
        What the program reports; of a sweep in parts that of the first.
    """

    def __init__(self, points: Part) -> None:
        split = [head.partition(" [") for head in points.heads]
        self.columns = [name for name, _, _ in split]
        self.units = {name: unit.rstrip("]") for name, _, unit in split}
        self.heads = points.heads
        self.rows = points.rows
        self.flip_bar = points.flip_bar
        self.bars = points.bars
        self.status = points.status
        self.causes = dict(points.causes)
        self.first = points.first
        self.counts: np.ndarray = np.bincount(points.status, minlength=len(STATUS))
        self.grid: tuple[int, ...] | None = None
        self.report: dict[str, Any] = json.loads(points.report)

    @property
    def success(self) -> bool:
        """Whether every point came to its end."""
        return not self.counts[1:].any()

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.units:
            raise KeyError(f"there is no column {name!r}; there are {', '.join(self.columns)}")
        return self.rows[:, self.columns.index(name)]

    def map(self, name: str) -> np.ndarray:
        """A column in the shape of the grid."""
        if self.grid is None:
            raise ValueError("the points are no whole grid")
        return self[name].reshape(self.grid)

    def to_pandas(self) -> Any:
        """The points as a ``pandas.DataFrame``, with bars, status and causes in words."""
        import pandas as pd

        frame = pd.DataFrame(self.rows, columns=self.columns, copy=False)
        bars = [self.bars[bar] if bar >= 0 else None for bar in self.flip_bar]
        causes = [self.causes.get(self.first + point) for point in range(len(self))]
        # None stays None.
        frame["flip_bar"] = pd.Series(bars, dtype=object)
        frame["status"] = [STATUS[status] for status in self.status]
        frame["cause"] = pd.Series(causes, dtype=object)
        frame.attrs["units"] = self.units
        return frame

    def to_xarray(self) -> Any:
        """A grid as an ``xarray.Dataset`` over what is varied, with units."""
        import xarray as xr

        if self.grid is None:
            raise ValueError("the points are no whole grid")
        names = self.columns[: len(self.grid)]
        coordinates = {}
        for k, name in enumerate(names):
            values = np.moveaxis(self.map(name), k, 0).reshape(self.grid[k], -1)[:, 0]
            coordinates[name] = (name, values, {"units": self.units[name]})
        variables = {
            name: (names, self.map(name), {"units": self.units[name]}) for name in self.columns[len(names) :]
        }
        return xr.Dataset(variables, coords=coordinates)

    def __repr__(self) -> str:
        told = ", ".join(f"{count} {word}" for count, word in zip(self.counts, STATUS) if count)
        kept = "" if len(self) == self.counts.sum() else " (in a file)"
        return f"<Sweep of {self.counts.sum()} points{kept}: {told or 'none'}>"


def swept(
    scene: Scene,
    vary: Mapping[str, Any],
    *,
    client: Any,
    parts: int | None,
    to: Any,
    chunk: int,
    threads: int,
    to_flip: bool,
    shard: tuple[int, int] | None,
    progress: bool,
    resume: bool,
    options: dict[str, Any],
) -> Sweep:
    """See :meth:`Scene.sweep`."""
    axes, listed = _points(vary)
    total = len(listed[1]) if listed else math.prod(axis[3] for axis in axes)
    if total == 0 and to is None:
        raise ValueError("there are no points: the arrays are empty")
    threads = min(_whole("threads", threads, 0, 1024), max(total, 1))
    chunk = _whole("chunk", chunk, 1)
    parts = None if parts is None else _whole("parts", parts, 1)
    if shard is not None:
        if not isinstance(shard, Sequence) or len(shard) != 2:
            raise ValueError(f"shard = {shard!r}: it is (I, N), part I of N")
        of = _whole("the second of shard", shard[1], 1)
        shard = _whole("the first of shard", shard[0], 1, of), of
    plan = {"axes": axes, "listed": listed, "to_flip": to_flip, "threads": threads, "options": options}
    count = 1
    if shard is None and client is not None:
        count = max(1, min(parts or 4 * _workers(client), max(total, 1)))
    elif shard is None and to is not None:
        count = max(1, -(-total // chunk))

    def found(numbers: Sequence[int]) -> Iterable[Part]:
        """The parts of these numbers, from 1 to `count`."""
        if shard is not None:
            return (_part(scene, *_share(plan, shard)) for _ in numbers)
        if client is not None:
            return _submitted(scene, plan, client, numbers, count, total, progress)
        if to is not None:
            return (_part(scene, *_share(plan, (number, count))) for number in numbers)
        return [_part(scene, plan, None, 0, progress_bar(progress, total, unit=" points"))]

    if resume and to is None:
        raise ValueError("resume goes on with a file: name it by to=")
    if to is not None:
        mark = _fingerprint(scene, plan, count, shard) if resume else None
        sweep: Sweep = written(found, count, to, mark)
    else:
        sweep = _joined(list(found(range(1, count + 1))))
    if shard is None and not listed and to is None:
        sweep.grid = tuple(axis[3] for axis in axes)
    return sweep


def _points(vary: Mapping[str, Any]) -> tuple[list[tuple[str, float, float, int]], Any]:
    """The axes of a grid, or the names and values of a list."""
    if not vary:
        raise ValueError("nothing is varied")
    ranges = [name for name, value in vary.items() if isinstance(value, tuple)]
    if len(ranges) == len(vary):
        return [_range(name, value) for name, value in vary.items()], None
    if ranges:
        raise ValueError(
            f"{ranges[0]}: a tuple is a range of a grid, where every name has one; beside arrays write "
            "numpy.linspace(from, to, count), or a list"
        )
    for name, value in vary.items():
        if np.iscomplexobj(value):
            raise ValueError(f"{name}: a list of points has real numbers, not complex ones")
        if np.ma.is_masked(value):
            raise ValueError(f"{name}: a list of points has no masked values; leave these points out")
    try:
        arrays = [np.asarray(value, dtype=float) for value in vary.values()]
    except (TypeError, ValueError) as error:
        raise ValueError(f"a list of points has an array of numbers for each name: {error}") from None
    if any(array.ndim != 1 or len(array) != len(arrays[0]) for array in arrays):
        raise ValueError("a list of points has one array of one length for each name; a range is a tuple")
    return [], (list(vary), np.column_stack(arrays))


def _range(name: str, value: tuple[Any, ...]) -> tuple[str, float, float, int]:
    """A range of a grid."""
    try:
        first, last, count = value
        first, last = float(first), float(last)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: a range is (from, to, count), not {value!r}") from None
    if not (math.isfinite(first) and math.isfinite(last)):
        raise ValueError(f"{name}: a range is (from, to, count) with finite ends, not {value!r}")
    return name, first, last, _whole(f"the count of {name}", count, 1)


def _whole(name: str, value: Any, least: int, most: int | None = None) -> int:
    """A whole number within bounds, of Python or numpy."""
    try:
        number = int(value)
        is_whole = number == value
    except (TypeError, ValueError, OverflowError):
        number, is_whole = 0, False
    if not is_whole or number < least or (most is not None and number > most):
        bounds = f"from {least} up" if most is None else f"from {least} to {most}"
        raise ValueError(f"{name} is a whole number {bounds}, not {value!r}")
    return number


def _share(plan: dict[str, Any], shard: tuple[int, int] | None) -> tuple[dict[str, Any], Any, int]:
    """A part of a plan, which of a list takes its own points along only, and the number of its first point."""
    if plan["listed"] is None or shard is None:
        return plan, shard, 0
    (number, of), (names, values) = shard, plan["listed"]
    begin, end = len(values) * (number - 1) // of, len(values) * number // of
    return {**plan, "listed": (names, values[begin:end])}, None, begin


def _part(scene: Scene, plan: dict[str, Any], shard: tuple[int, int] | None, first: int, bar: Any = None) -> Part:
    """What :func:`_share` gave, wherever it runs."""
    listed = plan["listed"]
    if listed is not None and len(listed[1]) == 0:
        return _empty(scene, plan)
    update = (lambda points: bar.update(points - bar.n)) if bar is not None else None
    part = Part(
        *_core.sweep(
            scene._core, plan["axes"], listed, plan["to_flip"], plan["threads"], shard, update, **plan["options"]
        )
    )
    if bar is not None:
        bar.close()
    causes = [(first + index, cause) for index, cause in part.causes]
    return part._replace(causes=causes, first=first + part.first)


def _empty(scene: Scene, plan: dict[str, Any]) -> Part:
    """A part without points: its columns are those of any point."""
    names, options = plan["listed"][0], {**plan["options"], "max_evaluations": 1}
    part = Part(
        *_core.sweep(scene._core, [], (names, np.ones((1, len(names)))), plan["to_flip"], 1, None, None, **options)
    )
    none = slice(0)
    return Part(part.heads, part.rows[none], part.flip_bar[none], part.status[none], [], "{}", part.bars, 0)


def _submitted(
    scene: Scene,
    plan: dict[str, Any],
    client: Any,
    numbers: Sequence[int],
    count: int,
    total: int,
    progress: bool,
) -> Iterator[Part]:
    """Parts by a client, in the order of the points."""
    plan = {**plan, "threads": plan["threads"] or 1}
    futures = [client.submit(_part, scene, *_share(plan, (number, count))) for number in numbers]
    bar = progress_bar(progress, total, unit=" points")
    for number, future in zip(numbers, futures):
        yield future.result()
        if bar is not None:
            bar.update(total * number // count - bar.n)
    if bar is not None:
        bar.close()


def _fingerprint(scene: Scene, plan: dict[str, Any], count: int, shard: Any) -> str:
    """What a file must have been written by to be gone on with."""
    listed = plan["listed"]
    points = None if listed is None else (listed[0], hashlib.sha256(listed[1].tobytes()).hexdigest())
    settings = {name: _plain(value) for name, value in plan["options"].items() if value is not None}
    text, _, *changed = scene._core.parts()
    version = (_core.__version__, "progress with bars")
    text = repr((text, changed, plan["axes"], points, bool(plan["to_flip"]), settings, count, shard, version))
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """A setting as one of Python, whose text is one and the same for equal numbers."""
    value = value.item() if isinstance(value, (np.generic, np.ndarray)) and np.ndim(value) == 0 else value
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _workers(client: Any) -> int:
    """How many workers a client has, as far as that is known."""
    threads = getattr(client, "nthreads", None)
    if callable(threads):
        return max(1, len(threads()))
    return getattr(client, "_max_workers", None) or os.cpu_count() or 1


def _joined(parts: list[Part]) -> Sweep:
    """The points of all parts, in their order, and the report of the first."""
    if len(parts) == 1:
        return Sweep(parts[0])
    rows, flip_bar, status = (np.concatenate(column) for column in list(zip(*parts))[1:4])
    causes = [cause for part in parts for cause in part.causes]
    return Sweep(parts[0]._replace(rows=rows, flip_bar=flip_bar, status=status, causes=causes))

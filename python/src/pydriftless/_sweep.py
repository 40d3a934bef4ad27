"""Sweeps: many runs of one scene, here or by whoever takes work."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._progress import progress_bar

if TYPE_CHECKING:
    from ._scene import Scene

STATUS = ("done", "stopped", "refused", "skipped")


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
        Number of the bar that turned over first, -1 for none.
    status : numpy.ndarray
        0 done, 1 stopped, 2 refused, 3 skipped.
    causes : dict
        Why points stopped or were refused, by their number.
    grid : tuple of int or None
        Numbers of values, where the points are a whole grid.
    report : dict
        What the program reports; of a sweep in parts that of the first.
    """

    def __init__(self, heads: list[str], rows: np.ndarray, flip_bar: np.ndarray, status: np.ndarray) -> None:
        split = [head.partition(" [") for head in heads]
        self.columns = [name for name, _, _ in split]
        self.units = {name: unit.rstrip("]") for name, _, unit in split}
        self.heads = heads
        self.rows = rows
        self.flip_bar = flip_bar
        self.status = status
        self.causes: dict[int, str] = {}
        self.grid: tuple[int, ...] | None = None
        self.report: dict[str, Any] = {}

    @property
    def success(self) -> bool:
        """Whether every point came to its end."""
        return bool((self.status == 0).all())

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
        """The points as a ``pandas.DataFrame``, with their status in words."""
        import pandas as pd

        frame = pd.DataFrame(self.rows, columns=self.columns, copy=False)
        frame["status"] = [STATUS[status] for status in self.status]
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
        counts = np.bincount(self.status, minlength=len(STATUS)) if len(self.status) else [0] * len(STATUS)
        told = ", ".join(f"{count} {word}" for count, word in zip(counts, STATUS) if count)
        return f"<Sweep of {len(self)} points: {told or 'none kept'}>"


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
    options: dict[str, Any],
) -> Sweep:
    """See :meth:`Scene.sweep`."""
    axes, listed = _points(vary)
    total = len(listed[1]) if listed else int(np.prod([axis[3] for axis in axes], dtype=object))
    plan = {"axes": axes, "listed": listed, "to_flip": to_flip, "threads": threads, "options": options}
    found: Iterable[Any]
    if shard is not None:
        found = [_part(scene, *_share(plan, shard))]
    elif client is not None:
        found = _submitted(scene, plan, client, parts or 4 * _workers(client), total, progress)
    elif to is not None:
        count = -(-total // chunk)
        found = (_part(scene, *_share(plan, (number, count))) for number in range(1, count + 1))
    else:
        found = [_part(scene, plan, None, 0, progress_bar(progress, total, unit=" points"))]
    sweep = _written(found, to) if to is not None else _joined(list(found))
    if shard is None and not listed and to is None:
        sweep.grid = tuple(axis[3] for axis in axes)
    return sweep


def _points(vary: Mapping[str, Any]) -> tuple[list[tuple[str, float, float, int]], Any]:
    """The axes of a grid, or the names and values of a list."""
    if not vary:
        raise ValueError("nothing is varied")
    if all(isinstance(value, tuple) for value in vary.values()):
        axes = []
        for name, value in vary.items():
            if len(value) != 3:
                raise ValueError(f"{name}: a range is (from, to, count), not {value!r}")
            axes.append((name, float(value[0]), float(value[1]), int(value[2])))
        return axes, None
    arrays = [np.asarray(value, dtype=float) for value in vary.values()]
    if any(array.ndim != 1 or len(array) != len(arrays[0]) for array in arrays):
        raise ValueError("a list of points has one array of one length for each name; a range is a tuple")
    return [], (list(vary), np.column_stack(arrays))


def _share(plan: dict[str, Any], shard: tuple[int, int] | None) -> tuple[dict[str, Any], Any, int]:
    """A part of a plan, which of a list takes its own points along only, and the number of its first point."""
    if plan["listed"] is None or shard is None:
        return plan, shard, 0
    (number, of), (names, values) = shard, plan["listed"]
    begin, end = len(values) * (number - 1) // of, len(values) * number // of
    return {**plan, "listed": (names, values[begin:end])}, None, begin


def _part(scene: Scene, plan: dict[str, Any], shard: tuple[int, int] | None, first: int, bar: Any = None) -> Any:
    """What :func:`_share` gave, wherever it runs."""
    listed = plan["listed"]
    if listed is not None and len(listed[1]) == 0:
        return None
    update = (lambda points: bar.update(points - bar.n)) if bar is not None else None
    heads, rows, flips, status, causes, report = _core.sweep(
        scene._core, plan["axes"], listed, plan["to_flip"], plan["threads"], shard, update, **plan["options"]
    )
    if bar is not None:
        bar.close()
    return heads, rows, flips, status, [(first + index, cause) for index, cause in causes], report


def _submitted(scene: Scene, plan: dict[str, Any], client: Any, parts: int, total: int, progress: bool) -> list[Any]:
    """All parts by a client, in the order of the points."""
    parts = max(1, min(parts, total))
    plan = {**plan, "threads": plan["threads"] or 1}
    futures = [client.submit(_part, scene, *_share(plan, (number, parts))) for number in range(1, parts + 1)]
    bar = progress_bar(progress, total, unit=" points")
    found = []
    for number, future in enumerate(futures, start=1):
        found.append(future.result())
        if bar is not None:
            bar.update(total * number // parts - bar.n)
    if bar is not None:
        bar.close()
    return found


def _workers(client: Any) -> int:
    """How many workers a client has, as far as that is known."""
    threads = getattr(client, "nthreads", None)
    if callable(threads):
        return max(1, len(threads()))
    return getattr(client, "_max_workers", None) or os.cpu_count() or 1


def _joined(found: list[Any]) -> Sweep:
    found = [part for part in found if part is not None]
    heads = found[0][0]
    columns = zip(*(part[1:4] for part in found))
    rows, flips, status = (parts[0] if len(parts) == 1 else np.concatenate(parts) for parts in columns)
    sweep = Sweep(heads, rows, flips, status)
    sweep.causes = {index: cause for part in found for index, cause in part[4]}
    sweep.report = json.loads(found[0][5])
    return sweep


def _written(found: Iterable[Any], to: Any) -> Sweep:
    """The parts as a file, one after the other; the numbers are not kept."""
    path = os.fspath(to)
    if not path.endswith((".csv", ".parquet")):
        raise ValueError(f"{path}: the file ends in .csv or .parquet")
    write = _Csv(path) if path.endswith(".csv") else _Parquet(path)
    heads: list[str] = []
    causes: dict[int, str] = {}
    report = "{}"
    with write:
        for part in found:
            if part is None:
                continue
            heads, report = part[0], part[5] if report == "{}" else report
            causes.update(part[4])
            write.part(part)
    sweep = Sweep(heads, np.empty((0, len(heads))), np.empty(0, np.int32), np.empty(0, np.uint8))
    sweep.causes, sweep.report = causes, json.loads(report)
    return sweep


class _Csv:
    def __init__(self, path: str) -> None:
        self._path = path

    def __enter__(self) -> _Csv:
        self._file = open(self._path, "w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._has_header = False
        return self

    def part(self, part: Any) -> None:
        heads, rows, _, status, _, _ = part
        if not self._has_header:
            self._writer.writerow([*heads, "status"])
            self._has_header = True
        for row, state in zip(rows.tolist(), status):
            numbers = ("" if math.isnan(number) else repr(number) for number in row)
            self._writer.writerow([*numbers, STATUS[state]])

    def __exit__(self, *_: object) -> None:
        self._file.close()


class _Parquet:
    def __init__(self, path: str) -> None:
        self._path = path
        self._writer: Any = None

    def __enter__(self) -> _Parquet:
        return self

    def part(self, part: Any) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        heads, rows, flips, status, _, _ = part
        columns = {head: pa.array(np.ascontiguousarray(rows[:, k])) for k, head in enumerate(heads)}
        columns["flip_bar"] = pa.array(flips)
        columns["status"] = pa.array(status)
        table = pa.table(columns)
        if self._writer is None:
            self._writer = pq.ParquetWriter(self._path, table.schema)
        self._writer.write_table(table)

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()

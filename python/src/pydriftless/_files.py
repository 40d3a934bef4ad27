"""Points of a sweep as files, written as they come, and gone on with after an interruption."""

from __future__ import annotations

import csv
import json
import math
import os
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np


def written(found: Callable[[int], Iterable[Any]], to: Any, mark: str | None) -> Any:
    """The parts as a file, one after the other; the numbers are not kept.

    Parameters
    ----------
    found : callable
        The parts that follow so many.
    to : path
        A ``.csv`` or ``.parquet`` file.
    mark : str, optional
        What tells the sweep from others; with it a file that was begun is gone on with.
    """
    from ._sweep import Sweep

    path = os.fspath(to)
    if not path.endswith((".csv", ".parquet")):
        raise ValueError(f"{path}: the file ends in .csv or .parquet")
    state = _State(path, mark)
    write = _Csv(path, state) if path.endswith(".csv") else _Parquet(path, state)
    with write:
        for part in found(state.parts):
            if part is None:
                continue
            state.take(part)
            write.part(part)
            state.save()
    state.remove()
    heads = state.heads
    sweep = Sweep(heads, np.empty((0, len(heads))), np.empty(0, np.int32), np.empty(0, np.uint8))
    sweep.causes, sweep.report = dict(state.causes), json.loads(state.report)
    return sweep


class _State:
    """What of a sweep is in its file, kept beside it while it is written."""

    def __init__(self, path: str, mark: str | None) -> None:
        self._mark = mark
        self._path = Path(path + ".progress")
        self.parts, self.size = 0, 0
        self.heads: list[str] = []
        self.causes: list[tuple[int, str]] = []
        self.report = "{}"
        if mark is None or not self._path.exists():
            return
        known = json.loads(self._path.read_text(encoding="utf-8"))
        if known.pop("mark") != mark:
            raise ValueError(f"{path} was begun by another sweep: remove {self._path.name} to begin anew")
        self.parts, self.size, self.heads, self.report = (known[key] for key in ("parts", "size", "heads", "report"))
        self.causes = [(index, cause) for index, cause in known["causes"]]

    def take(self, part: Any) -> None:
        heads, _, _, _, causes, report = part
        self.parts += 1
        self.heads = self.heads or heads
        self.report = report if self.report == "{}" else self.report
        self.causes.extend(causes)

    def save(self) -> None:
        if self._mark is None:
            return
        names = ("parts", "size", "heads", "causes", "report")
        text = json.dumps({"mark": self._mark, **{name: getattr(self, name) for name in names}})
        beside = self._path.with_suffix(".progress-new")
        beside.write_text(text, encoding="utf-8")
        os.replace(beside, self._path)

    def remove(self) -> None:
        self._path.unlink(missing_ok=True)

    @property
    def is_kept(self) -> bool:
        return self._mark is not None


class _Csv:
    def __init__(self, path: str, state: _State) -> None:
        self._path, self._state = path, state

    def __enter__(self) -> _Csv:
        if self._state.parts:
            # What was written after the last part that counts is written again.
            os.truncate(self._path, self._state.size)
        self._file = open(self._path, "a" if self._state.parts else "w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file, lineterminator="\n")
        return self

    def part(self, part: Any) -> None:
        from ._sweep import STATUS

        heads, rows, _, status, _, _ = part
        if self._state.parts == 1:
            self._writer.writerow([*heads, "status"])
        for row, state in zip(rows.tolist(), status):
            numbers = ("" if math.isnan(number) else repr(number) for number in row)
            self._writer.writerow([*numbers, STATUS[state]])
        if self._state.is_kept:
            self._file.flush()
            os.fsync(self._file.fileno())
            self._state.size = self._file.tell()

    def __exit__(self, *_: object) -> None:
        self._file.close()


class _Parquet:
    """One file; of a sweep that may be gone on with, a file for each part until all are there."""

    def __init__(self, path: str, state: _State) -> None:
        self._path, self._state = path, state
        self._parts = Path(path + ".parts")
        self._writer: Any = None

    def __enter__(self) -> _Parquet:
        if self._state.is_kept:
            if not self._state.parts:
                shutil.rmtree(self._parts, ignore_errors=True)
            self._parts.mkdir(exist_ok=True)
        return self

    def part(self, part: Any) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        heads, rows, flips, status, _, _ = part
        columns = {head: pa.array(np.ascontiguousarray(rows[:, k])) for k, head in enumerate(heads)}
        columns["flip_bar"] = pa.array(flips)
        columns["status"] = pa.array(status)
        table = pa.table(columns)
        if self._state.is_kept:
            pq.write_table(table, self._place(self._state.parts))
        else:
            self._append(table)

    def _place(self, number: int) -> Path:
        return self._parts / f"{number:06}.parquet"

    def _append(self, table: Any) -> None:
        import pyarrow.parquet as pq

        if self._writer is None:
            self._writer = pq.ParquetWriter(self._path, table.schema)
        self._writer.write_table(table)

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None and self._state.is_kept:
            import pyarrow.parquet as pq

            for number in range(1, self._state.parts + 1):
                if self._place(number).exists():
                    self._append(pq.read_table(self._place(number)))
            shutil.rmtree(self._parts)
        if self._writer is not None:
            self._writer.close()

"""Points of a sweep as files, written as they come, and gone on with after an interruption.

Beside a file that may be gone on with lies ``.progress``: a line that tells the sweep from others, then one for
each part with what verifies it.  What does not agree with its line is computed again.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._sweep import Part, Sweep


def written(found: Callable[[Sequence[int]], Iterable[Part]], count: int, to: Any, mark: str | None) -> Sweep:
    """The parts as a file, one after the other; the numbers are not kept.

    Parameters
    ----------
    found : callable
        The parts of these numbers, in their order.
    count : int
        How many parts there are, numbered from 1.
    to : path
        A ``.csv`` or ``.parquet`` file.
    mark : str, optional
        What tells the sweep from others; with it a file that was begun is gone on with.
    """
    from ._sweep import Part, Sweep

    path = os.fspath(to)
    if not path.endswith((".csv", ".parquet")):
        raise ValueError(f"{path}: the file ends in .csv or .parquet")
    progress = _Progress(path, mark)
    write = _Csv(path, progress) if path.endswith(".csv") else _Parquet(path, progress, count)
    progress.begin()
    with write:
        missing = [number for number in range(1, count + 1) if number not in progress.parts]
        for part, number in zip(found(missing), missing):
            progress.add(number, part, write.part(number, part))
    progress.remove()
    parts = [progress.parts[number] for number in sorted(progress.parts)]
    first, causes = parts[0], [cause for part in parts for cause in part["causes"]]
    rows, flip_bar, status = np.empty((0, len(first["heads"]))), np.empty(0, np.int32), np.empty(0, np.uint8)
    sweep = Sweep(Part(first["heads"], rows, flip_bar, status, causes, first["report"], first["bars"], 0))
    sweep.counts = np.sum([part["counts"] for part in parts], axis=0)
    return sweep


class _Progress:
    """The parts that are in a file, and beside it while it is written, where it may be gone on with."""

    def __init__(self, path: str, mark: str | None) -> None:
        self._mark = mark
        self._path = Path(path + ".progress")
        self.parts: dict[int, dict[str, Any]] = {}
        if mark is None or not self._path.exists():
            return
        lines = self._path.read_bytes().split(b"\n")
        begun = _read(lines[0])
        if "mark" not in begun:
            return
        if begun["mark"] != mark:
            raise ValueError(f"{path} was begun by another sweep: remove {self._path.name} to begin anew")
        for part in map(_read, lines[1:]):
            if part.keys() >= {"number", "heads", "bars", "counts", "causes", "report", "size", "sha256"}:
                self.parts[int(part["number"])] = part

    @property
    def is_kept(self) -> bool:
        return self._mark is not None

    def begin(self) -> None:
        """Writes what holds of the parts; where nothing is to be kept, what another sweep left goes away."""
        if self._mark is None:
            self.remove()
            return
        lines = [{"mark": self._mark}, *self.parts.values()]
        beside = self._path.with_suffix(".progress-new")
        beside.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
        os.replace(beside, self._path)

    def add(self, number: int, part: Part, proof: dict[str, Any]) -> None:
        """Takes a part that is in its file."""
        counts = np.bincount(part.status, minlength=4).tolist()
        told = {"number": number, "heads": part.heads, "bars": part.bars, "counts": counts, "causes": part.causes}
        told |= {"report": part.report if number == 1 else "{}", **proof}
        self.parts[number] = told
        if self._mark is not None:
            with open(self._path, "a", encoding="utf-8") as file:
                file.write(json.dumps(told) + "\n")
                file.flush()
                os.fsync(file.fileno())

    def remove(self) -> None:
        self._path.unlink(missing_ok=True)


def _read(line: bytes) -> dict[str, Any]:
    """A line of progress, or nothing where it is damaged."""
    try:
        found = json.loads(line)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


class _Csv:
    """One file: its parts follow each other, so that all before the first that does not agree count."""

    def __init__(self, path: str, progress: _Progress) -> None:
        self._path, self._progress = path, progress
        self._hash = hashlib.sha256()
        self._size = 0
        last = 0
        while last + 1 in progress.parts:
            last += 1
        if last and not self._agrees(progress.parts[last]):
            last, self._hash, self._size = 0, hashlib.sha256(), 0
        progress.parts = {number: progress.parts[number] for number in range(1, last + 1)}

    def _agrees(self, part: dict[str, Any]) -> bool:
        try:
            with open(self._path, "rb") as file:
                while self._size < part["size"] and (content := file.read(min(1 << 20, part["size"] - self._size))):
                    self._hash.update(content)
                    self._size += len(content)
        except FileNotFoundError:
            return False
        return bool(self._size == part["size"]) and self._hash.hexdigest() == part["sha256"]

    def __enter__(self) -> _Csv:
        if self._size:
            # What was written after the last part that counts is written again.
            os.truncate(self._path, self._size)
        self._file = open(self._path, "ab" if self._size else "wb")
        return self

    def part(self, number: int, part: Part) -> dict[str, Any]:
        if number == 1:
            self._write([[*part.heads, "flip_bar", "status", "cause"]])
        numbers = (["" if math.isnan(number) else repr(number) for number in row] for row in part.rows.tolist())
        self._write([*row, *words] for row, words in zip(numbers, _words(part)))
        if self._progress.is_kept:
            self._file.flush()
            os.fsync(self._file.fileno())
        return {"size": self._size, "sha256": self._hash.hexdigest()}

    def _write(self, rows: Iterable[list[str]]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        content = text.getvalue().encode()
        self._file.write(content)
        self._hash.update(content)
        self._size += len(content)

    def __exit__(self, *_: object) -> None:
        self._file.close()


class _Parquet:
    """One file under its name when it is whole; a file for each part until then, where it may be gone on with."""

    def __init__(self, path: str, progress: _Progress, count: int) -> None:
        self._path, self._progress, self._count = path, progress, count
        self._parts = Path(path + ".parts")
        self._beside = path + ".new"
        self._writer: Any = None
        progress.parts = {number: part for number, part in progress.parts.items() if self._agrees(number, part)}

    def _agrees(self, number: int, part: dict[str, Any]) -> bool:
        try:
            return number <= self._count and _proof(self._place(number)).items() <= part.items()
        except FileNotFoundError:
            return False

    def __enter__(self) -> _Parquet:
        if not self._progress.parts:
            shutil.rmtree(self._parts, ignore_errors=True)
        if self._progress.is_kept:
            self._parts.mkdir(exist_ok=True)
        return self

    def part(self, number: int, part: Part) -> dict[str, Any]:
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = [np.ascontiguousarray(column) for column in part.rows.T]
        table = {head: pa.array(column, mask=np.isnan(column)) for head, column in zip(part.heads, columns)}
        table["flip_bar"] = pa.array(part.flip_bar, mask=part.flip_bar < 0)
        table["status"] = pa.array(part.status)
        table["cause"] = pa.array([cause or None for _, _, cause in _words(part)], pa.string())
        table = pa.table(table)
        if not self._progress.is_kept:
            self._append(table)
            return {}
        pq.write_table(table, self._place(number))
        return _proof(self._place(number))

    def _place(self, number: int) -> Path:
        return self._parts / f"{number:06}.parquet"

    def _append(self, table: Any) -> None:
        import pyarrow.parquet as pq

        if self._writer is None:
            self._writer = pq.ParquetWriter(self._beside, table.schema)
        self._writer.write_table(table)

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            if kind is None and self._progress.is_kept:
                import pyarrow.parquet as pq

                for number in range(1, self._count + 1):
                    self._append(pq.read_table(self._place(number)))
        finally:
            if self._writer is not None:
                self._writer.close()
        if kind is not None:
            Path(self._beside).unlink(missing_ok=True)
            return
        os.replace(self._beside, self._path)
        # The file is whole: from here on nothing beside it counts.
        self._progress.remove()
        shutil.rmtree(self._parts, ignore_errors=True)


def _proof(path: Path) -> dict[str, Any]:
    """What a file of a part is verified by."""
    content = path.read_bytes()
    return {"size": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def _words(part: Part) -> Iterator[tuple[str, str, str]]:
    """Of every point the bar that turned over first, its status, and why it has no end; empty where there is none."""
    from ._sweep import STATUS

    causes = dict(part.causes)
    for point, (bar, status) in enumerate(zip(part.flip_bar, part.status)):
        yield part.bars[bar] if bar >= 0 else "", STATUS[status], causes.get(part.first + point, "")

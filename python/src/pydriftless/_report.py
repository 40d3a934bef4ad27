"""What a command of the program says, and the pictures it draws."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ._core import DriftlessError, RequestRefused, SceneRefused

#: Formats of pictures; that of which there is one counts as the picture, others beside it are extra.
_FORMATS = ("png", "svg", "pdf", "gif")

_PROGRAM = ("-m", "pydriftless")


class Picture:
    """A chart as the content of a file; notebooks show it.

    Attributes
    ----------
    data : bytes
        The file.
    format : str
        ``"png"``, ``"svg"``, ``"pdf"``, ``"gif"`` or ``"apng"``.
    """

    def __init__(self, data: bytes, format: str) -> None:
        self.data = data
        self.format = format

    def save(self, path: str | Path) -> None:
        """Write the file."""
        Path(path).write_bytes(self.data)

    def __repr__(self) -> str:
        return f"<Picture: {self.format}, {len(self.data)} bytes>"

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        kinds = {"png": "image/png", "apng": "image/png", "svg": "image/svg+xml", "gif": "image/gif"}
        kind = kinds.get(self.format)
        if kind is None:
            return {"text/plain": repr(self)}
        return {kind: self.data.decode() if self.format == "svg" else self.data}


class Report(dict[str, Any]):
    """The JSON report of a command as a dict.

    Attributes
    ----------
    pictures : dict[str, Picture]
        The charts the command drew, by their names; one that is there in several formats also by its name
        with the ending, as ``"mode1.gif"``.
    """

    pictures: dict[str, Picture]

    def __init__(self, *args: Any, pictures: dict[str, Picture] | None = None) -> None:
        super().__init__(*args)
        self.pictures = pictures or {}

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        for picture in self.pictures.values():
            return {"text/plain": repr(self), **picture._repr_mimebundle_()}
        return {"text/plain": repr(self)}


def flags(options: dict[str, Any]) -> list[str]:
    """Options of the program from keyword arguments: ``max_evaluations=5`` is ``--max-evaluations 5``."""
    words: list[str] = []
    for name, value in options.items():
        if isinstance(value, (np.generic, np.ndarray)):
            value = value.tolist()
        if value is None or value is False:
            continue
        flag = "--" + name.replace("_", "-")
        if value is True:
            words.append(flag)
        elif isinstance(value, (list, tuple)):
            words.append(f"{flag}={','.join(str(part) for part in value)}")
        else:
            words.append(f"{flag}={value!r}" if isinstance(value, float) else f"{flag}={value}")
    return words


def command(name: str, arguments: list[str], text: str | None, writes: bool) -> Report:
    """Run a command of the program in a process of its own, and read what it says.

    Raises
    ------
    SceneRefused, RequestRefused, DriftlessError
        As its exit code says: 3, 2, another.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, *_PROGRAM, name, *arguments, "--json"]
        if writes:
            words += ["--out", folder]
        done = subprocess.run(words, input=text, capture_output=True, text=True, encoding="utf-8", check=False)
        try:
            found = json.loads(done.stdout) if done.stdout.strip() else {}
        except json.JSONDecodeError:
            raise RequestRefused(f"{name} tells no report with {' '.join(arguments[1:])}") from None
        if done.returncode and set(found) <= {"error"}:
            raise _exception(done.returncode, found.get("error", {}), done.stderr)
        if writes:
            # It is gone when this returns.
            found.pop("folder", None)
        pictures: dict[str, Picture] = {}
        paths = [path for path in Path(folder).rglob("*") if path.suffix[1:] in _FORMATS]
        for path in sorted(paths, key=lambda path: (path.stem, _FORMATS.index(path.suffix[1:]))):
            name = path.name if path.stem in pictures else path.stem
            pictures[name] = Picture(path.read_bytes(), path.suffix[1:])
        return Report(found, pictures=pictures)


def _exception(code: int, error: dict[str, Any], said: str) -> DriftlessError:
    kind = {2: RequestRefused, 3: SceneRefused}.get(code, DriftlessError)
    message = said.strip().removeprefix("error: ") or f"exit code {code}"
    told = kind(message)
    details = error.get("details") or {}
    for key in ("line", "column", "path", "value", "allowed", "hint"):
        setattr(told, key, details.get(key))
    if told.hint is None and "\nhint: " in message:
        told.hint = message.split("\nhint: ", 1)[1]
    return told

"""Forces, torques, springs and potentials written in Python."""

from __future__ import annotations

import itertools
import json
import re
import string
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._trace import _NAME, State, named, written

if TYPE_CHECKING:
    from ._scene import Scene


def with_part(
    scene: Scene,
    kind: str,
    name: str,
    function: Callable[..., Any],
    fields: Mapping[str, Any],
    key: str,
) -> Scene:
    """The scene with one more part whose law a Python function gives."""
    if not _NAME.match(name):
        raise ValueError(f"a law is named by letters, digits and _, which {name!r} is not")
    text, source, before, outputs = scene._core.parts()
    described: dict[str, Any] = json.loads(text)
    bodies = [str(bar["name"]) for bar in described.get("bars", [])]
    prefix = _free(name, " ".join([text, *before, *outputs]))
    at = State(bodies, prefix)
    result = function(named("length"), named("rate")) if kind == "springs" else function(at)
    if kind == "forces":
        x, y = result
        formulas, signals = written([x, y], prefix)
        law: Any = formulas
    else:
        formulas, signals = written([result], prefix)
        law = formulas[0]
    if kind == "springs" and signals:
        # Signals know nothing of the length of one spring.
        law, signals = written([result], "")[0][0], {}
    described.setdefault(kind, []).append({"name": name, **fields, key: law})
    if signals:
        described["signals"] = {**described.get("signals", {}), **signals}
    if at.points:
        described["points"] = [*described.get("points", []), *at.points]
    if not source.startswith("<"):
        # Not the file any more, but beside it: files that a scene names count from its folder.
        source = str(Path(source).with_name(f"{Path(source).stem} with {name}"))
    return type(scene)(json.dumps(described, default=plain), source, before, outputs)


def _free(name: str, text: str) -> str:
    """What names of signals and points begin with, so that none of them is a word of the scene."""
    words = set(re.findall(r"\w+", text))
    taken = {begin for begin, _, end in (word.rpartition("_") for word in words) if re.fullmatch(r"p?\d+", end)}
    numbered = (f"{name}_{letter}" for letter in map(_letters, itertools.count()))
    return next(prefix for prefix in itertools.chain([name], numbered) if prefix not in taken)


def _letters(number: int) -> str:
    """a to z, then ba to zz and so on: no number, which would look like one of the names."""
    before, last = divmod(number, 26)
    return (_letters(before) if before else "") + string.ascii_lowercase[last]


def plain(value: Any) -> Any:
    """numpy's numbers and arrays as JSON has them."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"a scene holds numbers, words, lists and dicts, not {type(value).__name__}: {value!r}")

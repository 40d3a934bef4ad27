"""Forces, torques, springs and potentials written in Python."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
    at = State(bodies, name)
    result = function(named("length"), named("rate")) if kind == "springs" else function(at)
    if kind == "forces":
        x, y = result
        formulas, signals = written([x, y], name)
        law: Any = formulas
    else:
        formulas, signals = written([result], name)
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
    return type(scene)(json.dumps(described), source, before, outputs)

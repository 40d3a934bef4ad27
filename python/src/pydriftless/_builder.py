"""Scenes put together in Python."""

from __future__ import annotations

from typing import Any

from ._scene import Scene


def ground(x: float, y: float) -> dict[str, Any]:
    """A place on the ground [m]."""
    return {"body": "ground", "point": [x, y]}


def on(body: str, x: float, y: float) -> dict[str, Any]:
    """A place on a body, in its own axes from its origin [m]."""
    return {"body": body, "point": [x, y]}


class Builder:
    """A scene part by part; every method returns the builder.

    >>> pendulum = (
    ...     Builder("pendulum", gravity=(0, -9.81))
    ...     .bar("bar", mass=1, centre=(0.5, 0), inertia=1 / 12, length=1)
    ...     .hinge("A", ground(0, 0), on("bar", 0, 0))
    ...     .start("bar", phi=0.3, omega=0)
    ...     .build(until=2, every=0.1)
    ... )
    >>> pendulum.name
    'pendulum'
    """

    def __init__(self, name: str, gravity: tuple[float, float] = (0.0, -9.81), description: str = "") -> None:
        self._scene: dict[str, Any] = {"name": name, "gravity": list(gravity)}
        if description:
            self._scene["description"] = description

    def add(self, kind: str, **fields: Any) -> Builder:
        """A part of any kind of the scene format: ``add("springs", name=…, between=[…], …)``."""
        self._scene.setdefault(kind, []).append(fields)
        return self

    def bar(self, name: str, **fields: Any) -> Builder:
        """A body: ``mass``, ``centre``, ``inertia``, ``length``, or what else the format allows."""
        return self.add("bars", name=name, **fields)

    def hinge(self, name: str, first: dict[str, Any], second: dict[str, Any], **fields: Any) -> Builder:
        """A hinge between two places."""
        return self.add("hinges", name=name, between=[first, second], **fields)

    def slider(self, name: str, point: dict[str, Any], rail: dict[str, Any], **fields: Any) -> Builder:
        """A slider: a place on a rail, which has a ``direction`` beside its place."""
        return self.add("sliders", name=name, point=point, rail=rail, **fields)

    def spring(self, name: str, first: dict[str, Any], second: dict[str, Any], **fields: Any) -> Builder:
        """A spring between two places: ``stiffness``, ``free_length``, ``damping``."""
        return self.add("springs", name=name, between=[first, second], **fields)

    def motor(self, name: str, body: str, law: Any, **fields: Any) -> Builder:
        """A motor that turns a body by a law: a dict or a formula of ``t``."""
        return self.add("motors", name=name, body=body, law=law, **fields)

    def wall(self, name: str, **fields: Any) -> Builder:
        """A wall for a ``point`` of a ``body``: ``line={"through": [x, y], "normal": [x, y]}``, ``restitution``."""
        return self.add("walls", name=name, **fields)

    def start(self, body: str, **fields: float) -> Builder:
        """How a body starts: ``phi`` [rad], ``omega`` [rad/s]."""
        self._scene.setdefault("start", {})[body] = fields
        return self

    def set(self, **fields: Any) -> Builder:
        """Any other field of the scene."""
        self._scene.update(fields)
        return self

    def build(self, until: float | None = None, every: float | None = None) -> Scene:
        """The scene, compiled.

        Raises
        ------
        SceneRefused
            It is none.
        """
        times = {"until": until, "every": every}
        scene = {**self._scene, **{name: value for name, value in times.items() if value is not None}}
        return Scene.from_dict(scene, f"<{scene['name']}>")

"""Scenes: read, changed, run."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _core
from ._force import plain, with_part
from ._progress import progress_bar
from ._report import Report, command, flags
from ._run import Event, Run
from ._sweep import Sweep, swept
from ._trace import State


class Scene:
    """A mechanism with its start, compiled into equations of motion.

    Scenes do not change; :meth:`with_` makes another one.  They can be pickled.

    Parameters
    ----------
    text : str
        The scene as JSON.
    source : str
        What messages call it.
    set : sequence of str
        Values that replace those of the text, as ``"motor.rate=3.0"``.
    outputs : sequence of str
        Formulas that become columns, as ``"A.force"`` or ``"half=M.power/2"``.

    Raises
    ------
    SceneRefused
        With ``line``, ``column``, ``path``, ``value``, ``allowed`` and ``hint``.
    """

    def __init__(
        self, text: str, source: str = "<text>", set: Sequence[str] = (), outputs: Sequence[str] = ()
    ) -> None:
        self._core = _core.Scene(text, source, list(set), list(outputs))
        found = _with_tables(text, source)
        if found != text:
            # Files that it names are found from any working directory, and by whatever is made of it.
            self._core = _core.Scene(found, source, list(set), list(outputs))

    @classmethod
    def from_dict(cls, scene: Mapping[str, Any], source: str = "<dict>") -> Scene:
        """A scene from a dict of the same form as a file."""
        return cls(json.dumps(scene, default=plain), source)

    @property
    def name(self) -> str:
        """The scene's name."""
        return self._core.name

    @property
    def description(self) -> str:
        """The scene's description."""
        return self._core.description

    @property
    def columns(self) -> list[str]:
        """Names of the columns of its trajectories, with their units."""
        return self._core.columns()

    def to_dict(self) -> dict[str, Any]:
        """The scene as a dict, with everything replaced that was set."""
        scene: dict[str, Any] = json.loads(self._core.json())
        return scene

    def with_(self, values: Mapping[str, Any], /) -> Scene:
        """The scene with other values.

        Parameters
        ----------
        values : mapping
            Values by their paths or short names: ``{"motor.rate": 3.0, "bars[0].mass": 2}``.
        """
        text, source, before, outputs = self._core.parts()
        return Scene(text, source, [*before, *(f"{path}={_word(value)}" for path, value in values.items())], outputs)

    def with_outputs(self, *outputs: str) -> Scene:
        """The scene with further columns: ``scene.with_outputs("A.force", "half=M.power/2")``."""
        text, source, before, others = self._core.parts()
        return Scene(text, source, before, [*others, *outputs])

    def with_force(
        self, name: str, place: Mapping[str, Any], force: Callable[[State], tuple[Any, Any]]
    ) -> Scene:
        """The scene with a force written in Python.

        The function is called once, with symbols; what it computes becomes a formula of the scene, with the
        formula's speed and exactness in every method, in sweeps and after pickling.  It may use arithmetic,
        numpy's functions and :func:`where`; it cannot ask for numbers or call what needs them.

        Parameters
        ----------
        name : str
            Name of the force.
        place : dict
            Where it acts: ``on("bar2", 0.6, 0)``.
        force : callable
            From the state to both components [N].

        Examples
        --------
        >>> def drag(at):
        ...     vx, vy = at.velocity("bar2", (0.6, 0))
        ...     speed = np.hypot(vx, vy)
        ...     return -0.01 * speed * vx, -0.01 * speed * vy
        >>> scene.with_force("drag", on("bar2", 0.6, 0), drag)  # doctest: +SKIP
        """
        return with_part(self, "forces", name, force, place, "force")

    def with_torque(self, name: str, body: str, torque: Callable[[State], Any]) -> Scene:
        """The scene with a torque on a body [N·m]; see :meth:`with_force`."""
        return with_part(self, "torques", name, torque, {"body": body}, "torque")

    def with_spring(
        self,
        name: str,
        first: Mapping[str, Any],
        second: Mapping[str, Any],
        tension: Callable[[Any, Any], Any],
    ) -> Scene:
        """The scene with a spring that pulls its ends together by a function of its length and rate [N]."""
        return with_part(self, "springs", name, tension, {"between": [first, second]}, "tension")

    def with_potential(self, name: str, energy: Callable[[State], Any]) -> Scene:
        """The scene with a potential of angles and positions [J]; its gradient acts on the bodies."""
        return with_part(self, "potentials", name, energy, {}, "energy")

    def run(
        self,
        *,
        until: float | None = None,
        every: float | None = None,
        method: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        step: float | None = None,
        stabilize: str | None = None,
        time_constant: float | None = None,
        extended: bool = False,
        prefer: str | None = None,
        max_evaluations: float | None = None,
        max_energy_drift: float | None = None,
        max_constraint_drift: float | None = None,
        trust: str = "auto",
        dense: bool = False,
        callback: Callable[[float, np.ndarray], Any] | None = None,
        events: Sequence[Event] = (),
        progress: bool = False,
    ) -> Run:
        """Integrate the scene to its horizon.

        What is not said is decided as by the program.  The global lock is released; Ctrl-C raises
        :class:`Interrupted`, a ``KeyboardInterrupt`` whose ``checkpoint`` :func:`resume` goes on from.

        Parameters
        ----------
        until, every : float
            Horizon and output interval [s]; by default the scene's.
        method : str
            Such as ``"taylor"``, ``"dp8"``, ``"radau9"``, ``"gauss16"``, ``"rattle4"``.
        rtol, atol : float
            Tolerances of an adaptive method.
        step : float
            Step of a fixed-step method [s].
        stabilize : {"elimination", "projection", "baumgarte", "none"}
            How constraints are kept.
        trust : {"auto", "full", "off"}
            How much the error estimate may cost.
        dense : bool
            Keep the motion between the rows for ``run(t)``; without it ``run(t)`` integrates once more.
        callback : callable
            Called with the time and the row at every row; ``False``, and nothing else, ends the run.
        events : sequence of Event
            Events beside those of the scene.
        progress : bool
            Show a bar, where tqdm is installed.

        Returns
        -------
        Run
            A stop before the horizon is no exception: see ``success`` and ``message``.

        Raises
        ------
        RequestRefused
            The request makes no sense for the scene; ``hint`` says what does.
        """
        options = {
            "until": until,
            "every": every,
            "method": method,
            "rtol": rtol,
            "atol": atol,
            "step": step,
            "stabilize": stabilize,
            "time_constant": time_constant,
            "extended": extended,
            "prefer": prefer,
            "max_evaluations": max_evaluations,
            "max_energy_drift": max_energy_drift,
            "max_constraint_drift": max_constraint_drift,
            "trust": trust,
        }
        described = [event.described() for event in events]
        bar = progress_bar(
            progress,
            until if until is not None else self.to_dict().get("until"),
            unit="s",
            bar_format="{l_bar}{bar}| {n:.4g}/{total:.4g} s [{elapsed}]",
        )
        if bar is None:
            return Run(_core.run(self._core, callback, dense, described, **options), self, described)

        def tell(t: float, row: np.ndarray) -> Any:
            bar.update(t - bar.n)
            return callback(t, row) if callback is not None else None

        with bar:
            return Run(_core.run(self._core, tell, dense, described, **options), self, described)

    def stream(self, **options: Any) -> Iterator[np.ndarray]:
        """The rows of a run as an iterator, integrated as they are asked for.

        Takes the options of :meth:`run` but ``dense``, ``callback``, ``events`` and ``progress``; ``trust`` is
        ``"off"`` by default.  A stop before the horizon is an exception after the last row.  After Ctrl-C, which is
        a ``KeyboardInterrupt``, the rows go on where they were.
        """
        return _core.stream(self._core, **{"trust": "off", **options})

    def sweep(
        self,
        vary: Mapping[str, Any],
        *,
        client: Any = None,
        parts: int | None = None,
        to: str | os.PathLike[str] | None = None,
        chunk: int = 100_000,
        threads: int = 0,
        to_flip: bool = False,
        shard: tuple[int, int] | None = None,
        progress: bool = False,
        resume: bool = False,
        **options: Any,
    ) -> Sweep:
        """Run the scene over a grid or a list of points.

        Parameters
        ----------
        vary : mapping
            For a grid ``(from, to, count)`` by name, of which the first varies slowest; for a list arrays of
            one length by name.
        client : object with ``submit``
            Runs the parts elsewhere: a Dask client, an executor of ``concurrent.futures`` or of
            ``mpi4py.futures``.  The result is the same to the last bit.
        parts : int
            Parts for the client; by default four for each of its workers.
        to : path
            Write the rows to a ``.csv`` or ``.parquet`` file, ``chunk`` points at a time, instead of keeping
            them.
        threads : int
            Threads, at most 1024; 0 for all processors.
        to_flip : bool
            End each point when a bar first turns over.
        shard : (int, int)
            Part I of N alone.
        resume : bool
            With ``to``: keep what is needed to go on after an interruption beside the file, and go on where it
            is there.  What of it is missing or has changed is computed again.
        **options
            Those of :meth:`run`; ``trust`` is ``"off"`` by default.
        """
        return swept(
            self,
            vary,
            client=client,
            parts=parts,
            to=to,
            chunk=chunk,
            threads=threads,
            to_flip=to_flip,
            shard=shard,
            progress=progress,
            resume=resume,
            options=options,
        )

    def check(self, **options: Any) -> Report:
        """What is active, what is left out, and which method would run it."""
        return self._command("check", options, writes=False)

    def inspect(self, at: float | str | None = None, **options: Any) -> Report:
        """Accelerations, forces, motors and energy at the start, a time [s] or an event."""
        return self._command("inspect", {"at": at, **options}, writes=False)

    def kinematics(self, drive: str | None = None, **options: Any) -> Report:
        """The mechanism moved through the range of a drive without integrating."""
        return self._command("kinematics", {"drive": drive, **options}, writes=True)

    def modes(self, **options: Any) -> Report:
        """Equilibria and small vibrations, or periodic motions and their multipliers."""
        return self._command("modes", options, writes=True)

    def compare(self, **options: Any) -> Report:
        """Error, drift and run time of every method at all its settings."""
        return self._command("compare", options, writes=True)

    def _command(self, name: str, options: dict[str, Any], writes: bool) -> Report:
        text, source, before, outputs = self._core.parts()
        # The scene as it was loaded: the file may be another one by now.
        is_file = _as_loaded(source) == text
        arguments = [source if is_file else "-", *(f"--set={value}" for value in before), *flags(options)]
        if name in ("inspect", "kinematics"):
            arguments += [f"--output={output}" for output in outputs]
        return command(name, arguments, None if is_file else text, writes)

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene, self._core.parts()

    def __repr__(self) -> str:
        return f"<Scene {self.name!r}: {self.description}>" if self.description else f"<Scene {self.name!r}>"


def _with_tables(text: str, source: str) -> str:
    """A scene's text with the whole paths of the files its tables come from."""
    if '"tables"' not in text:
        return text
    try:
        tables = json.loads(text)["tables"].values()
    except (ValueError, KeyError, TypeError, AttributeError):
        return text
    named = [table.get("file") if isinstance(table, dict) else table for table in tables]
    files = {name for name in named if isinstance(name, str)}
    begin = text.index('"tables"')
    before, after = text[:begin], text[begin:]
    for file in files:
        if not os.path.isabs(file):
            whole = os.path.abspath(os.path.join(os.path.dirname(source), file))
            for ascii in (True, False):
                after = after.replace(json.dumps(file, ensure_ascii=ascii), json.dumps(whole))
    return before + after


def _as_loaded(source: str) -> str | None:
    """What loading a file gives now, if it is one."""
    try:
        return _with_tables(Path(source).read_text(encoding="utf-8"), source)
    except (OSError, ValueError):
        return None


def load(path: str | os.PathLike[str], set: Mapping[str, Any] | None = None) -> Scene:
    """Read a scene file.

    Parameters
    ----------
    path : path
        The file (JSON).
    set : mapping
        Values that replace those of the file, as for :meth:`Scene.with_`.
    """
    scene = Scene(Path(path).read_text(encoding="utf-8"), os.fspath(path))
    return scene.with_(set) if set else scene


def loads(text: str, set: Mapping[str, Any] | None = None) -> Scene:
    """Read a scene from its text."""
    scene = Scene(text)
    return scene.with_(set) if set else scene


def _word(value: Any) -> str:
    """A value as the program's ``--set`` takes it."""
    if isinstance(value, str):
        return value
    return json.dumps(value, default=plain)

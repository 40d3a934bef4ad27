"""Python functions as formulas: called once with symbols, they leave behind what they compute.

What is left is text of the formula language, which the crate differentiates, expands in series and evaluates in
any precision.  A force written in Python therefore runs at full speed in every method.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

#: Text beyond which a part that is used more than once becomes a signal, and any part does.
_SHORT, _LONG = 24, 1500

#: Nesting beyond which a part becomes a signal; the format allows 64 levels.
_DEEP = 40

_EQUAL = (
    "a force is traced once, so it cannot tell whether numbers are equal: use pydriftless.where with < or >="
)

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


class Symbol:
    """A number that is not known yet: arithmetic and numpy's functions of it make further ones."""

    __slots__ = ("parts", "uses")

    def __init__(self, *parts: str | Symbol) -> None:
        self.parts = parts
        self.uses = 0

    def __add__(self, other: Any) -> Symbol:
        return _joined(self, "+", other)

    def __radd__(self, other: Any) -> Symbol:
        return _joined(other, "+", self)

    def __sub__(self, other: Any) -> Symbol:
        return _joined(self, "-", other)

    def __rsub__(self, other: Any) -> Symbol:
        return _joined(other, "-", self)

    def __mul__(self, other: Any) -> Symbol:
        return _joined(self, "*", other)

    def __rmul__(self, other: Any) -> Symbol:
        return _joined(other, "*", self)

    def __truediv__(self, other: Any) -> Symbol:
        return _joined(self, "/", other)

    def __rtruediv__(self, other: Any) -> Symbol:
        return _joined(other, "/", self)

    def __pow__(self, other: Any) -> Symbol:
        return _joined(self, "^", other)

    def __rpow__(self, other: Any) -> Symbol:
        return _joined(other, "^", self)

    def __neg__(self) -> Symbol:
        return Symbol("(-", self, ")")

    def __pos__(self) -> Symbol:
        return self

    def __abs__(self) -> Symbol:
        return _call("abs", self)

    def __eq__(self, other: object) -> Any:
        raise TypeError(_EQUAL)

    def __ne__(self, other: object) -> Any:
        raise TypeError(_EQUAL)

    __hash__ = object.__hash__

    def __lt__(self, other: Any) -> Condition:
        return Condition(self, "<", other)

    def __le__(self, other: Any) -> Condition:
        return Condition(self, "<=", other)

    def __gt__(self, other: Any) -> Condition:
        return Condition(self, ">", other)

    def __ge__(self, other: Any) -> Condition:
        return Condition(self, ">=", other)

    def __bool__(self) -> bool:
        raise TypeError("a force is traced once, so it cannot ask for a value: use pydriftless.where")

    def __float__(self) -> float:
        raise TypeError("a force is traced once, so it has no numbers: use numpy's functions instead of math's")

    def __array_ufunc__(
        self,
        ufunc: np.ufunc,
        method: Literal["__call__", "reduce", "reduceat", "accumulate", "outer", "at"],
        *inputs: Any,
        **kwargs: Any,
    ) -> Any:
        # Names and types are those that numpy's declarations ask for.
        make = _UFUNCS.get(ufunc.__name__)
        if make is None or method != "__call__" or kwargs:
            raise TypeError(f"a force cannot use numpy.{ufunc.__name__}; there are {', '.join(sorted(_UFUNCS))}")
        return make(*inputs)

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> Any:
        if function is np.where and len(arguments) == 3 and not options:
            return where(*arguments)
        raise TypeError(f"a force cannot use numpy.{function.__name__}; numpy.where and its ufuncs it can")

    def __repr__(self) -> str:
        return f"<Symbol {_Writer('').text(self)}>"


class Condition:
    """A comparison of symbols, for :func:`where`."""

    def __init__(self, first: Any, sign: str, second: Any) -> None:
        self.parts = (first, sign, second)

    def __bool__(self) -> bool:
        raise TypeError("a force is traced once, so it cannot branch on a comparison: use pydriftless.where")

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> Any:
        return Symbol.__array_function__(self, function, types, arguments, options)  # type: ignore[arg-type]


def where(condition: Condition | bool, first: Any, second: Any) -> Any:
    """One of two values, as ``numpy.where``; in a force a *switch*, located like an impact.

    Parameters
    ----------
    condition : comparison
        Such as ``at.phi("bar") > 0``.
    first, second : number or symbol
        The value where it holds, and where it does not.
    """
    if not isinstance(condition, Condition):
        return first if condition else second
    left, sign, right = condition.parts
    return Symbol("if(", _of(left), sign, _of(right), ", ", _of(first), ", ", _of(second), ")")


def _of(value: Any) -> Symbol:
    if isinstance(value, Symbol):
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
        if isinstance(value, Symbol):
            return value
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"a force has the number {number}")
    return Symbol(repr(number) if number >= 0 else f"({number!r})")


def _joined(first: Any, sign: str, second: Any) -> Symbol:
    if not all(isinstance(one, Symbol) or np.isscalar(one) or np.ndim(one) == 0 for one in (first, second)):
        return NotImplemented
    return Symbol("(", _of(first), sign, _of(second), ")")


def _call(name: str, *values: Any) -> Symbol:
    parts: list[str | Symbol] = [f"{name}("]
    for k, value in enumerate(values):
        parts += [", ", _of(value)] if k else [_of(value)]
    return Symbol(*parts, ")")


def _of_name(name: str) -> Callable[..., Symbol]:
    return lambda *values: _call(name, *values)


_UFUNCS: dict[str, Callable[..., Any]] = {
    **{name: _of_name(name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "sign")},
    **{name: _of_name("abs") for name in ("absolute", "fabs")},
    **{name: _of_name("min") for name in ("minimum", "fmin")},
    **{name: _of_name("max") for name in ("maximum", "fmax")},
    "arctan2": _of_name("atan2"),
    "hypot": lambda a, b: _call("sqrt", _of(a) * a + _of(b) * b),
    "square": lambda a: _of(a) * a,
    "negative": lambda a: -_of(a),
    "positive": _of,
    "reciprocal": lambda a: 1 / _of(a),
    "add": lambda a, b: _of(a) + _of(b),
    "subtract": lambda a, b: _of(a) - _of(b),
    "multiply": lambda a, b: _of(a) * _of(b),
    "divide": lambda a, b: _of(a) / _of(b),
    "true_divide": lambda a, b: _of(a) / _of(b),
    "power": lambda a, b: _of(a) ** _of(b),
    "float_power": lambda a, b: _of(a) ** _of(b),
    "deg2rad": lambda a: _of(a) * (math.pi / 180),
    "radians": lambda a: _of(a) * (math.pi / 180),
    "less": lambda a, b: _of(a) < _of(b),
    "less_equal": lambda a, b: _of(a) <= _of(b),
    "greater": lambda a, b: _of(a) > _of(b),
    "greater_equal": lambda a, b: _of(a) >= _of(b),
}


def named(name: str) -> Symbol:
    """The symbol of a name of the state; the factor takes its unit away, as Python's numbers have none."""
    return Symbol("(1*", name, ")")


class _Writer:
    """Writes symbols as formulas; parts used several times, and long ones, as signals."""

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix
        self.signals: dict[str, str] = {}
        self._known: dict[int, str] = {}
        self._depths: dict[int, int] = {}

    def text(self, symbol: Symbol) -> str:
        """Its text, with what it is made of written first."""
        waiting = [(symbol, False)]
        while waiting:
            one, is_ready = waiting.pop()
            if id(one) in self._known:
                continue
            inner = [part for part in one.parts if isinstance(part, Symbol)]
            if not is_ready:
                waiting.append((one, True))
                waiting.extend((part, False) for part in inner)
                continue
            text = "".join(part if isinstance(part, str) else self._known[id(part)] for part in one.parts)
            depth = 1 + max((self._depths[id(part)] for part in inner), default=0)
            is_name = text.startswith("(1*")
            is_large = len(text) > _LONG or depth > _DEEP
            if self.prefix and (is_large or one.uses > 1 and len(text) > _SHORT and not is_name):
                name = f"{self.prefix}_{len(self.signals) + 1}"
                self.signals[name] = text
                text, depth = name, 0
            self._known[id(one)], self._depths[id(one)] = text, depth
        return self._known[id(symbol)]


def _count(symbols: list[Symbol]) -> None:
    """Counts how often each part is used."""
    seen: set[int] = set()
    waiting = list(symbols)
    while waiting:
        one = waiting.pop()
        one.uses += 1
        if id(one) not in seen:
            seen.add(id(one))
            waiting.extend(part for part in one.parts if isinstance(part, Symbol))


def written(values: list[Any], prefix: str) -> tuple[list[str], dict[str, str]]:
    """Formulas of symbols or numbers, and the signals they are made of."""
    symbols = [_of(value) for value in values]
    _count(symbols)
    writer = _Writer(prefix)
    # The factor leaves the unit open: a sine is a pure number, and a number alone no formula.
    texts = [f"1*{writer.text(symbol)}" for symbol in symbols]
    return texts, writer.signals


class State:
    """The state of a mechanism as symbols: what a force may depend on.

    It has the methods of the moment that events are asked about, so that one function serves both.

    Attributes
    ----------
    t : Symbol
        Time [s].
    """

    def __init__(self, bodies: list[str], prefix: str) -> None:
        self._bodies = bodies
        self._prefix = prefix
        self._names: dict[str, Symbol] = {}
        #: Points of bodies that were asked for, as the scene names them.
        self.points: list[dict[str, Any]] = []
        self.t = named("t")

    def _body(self, body: str) -> str:
        if body not in self._bodies:
            raise KeyError(f"there is no body {body!r}; there are {', '.join(self._bodies)}")
        if not _NAME.match(body):
            raise ValueError(f"a formula cannot name {body!r}: names have letters, digits and _ only")
        return body

    def _named(self, name: str) -> Symbol:
        return self._names.setdefault(name, named(name))

    def phi(self, body: str) -> Symbol:
        """Angle of a body from +x, with its whole turns [rad]."""
        return self._named(f"{self._body(body)}.phi")

    def omega(self, body: str) -> Symbol:
        """Its rate [rad/s]."""
        return self._named(f"{self._body(body)}.omega")

    def cos(self, body: str) -> Symbol:
        """Cosine of its angle."""
        return self._named(f"{self._body(body)}.cos")

    def sin(self, body: str) -> Symbol:
        """Sine of its angle."""
        return self._named(f"{self._body(body)}.sin")

    def _point(self, body: str, point: tuple[float, float]) -> str:
        x, y = point
        place = {"body": self._body(body), "point": [float(x), float(y)]}
        for known in self.points:
            if {"body": known["body"], "point": known["point"]} == place:
                return str(known["name"])
        self.points.append({"name": f"{self._prefix}_p{len(self.points) + 1}", **place})
        return str(self.points[-1]["name"])

    def position(self, body: str, point: tuple[float, float] = (0.0, 0.0)) -> tuple[Symbol, Symbol]:
        """Where a point of a body is, given in its own axes from its origin [m]."""
        name = self._point(body, point)
        return self._named(f"{name}.x"), self._named(f"{name}.y")

    def velocity(self, body: str, point: tuple[float, float] = (0.0, 0.0)) -> tuple[Symbol, Symbol]:
        """Its velocity [m/s]."""
        name = self._point(body, point)
        return self._named(f"{name}.vx"), self._named(f"{name}.vy")

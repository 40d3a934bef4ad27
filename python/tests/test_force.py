"""Forces written in Python: the numbers of formulas and of built-in springs."""

import math
import pickle

import numpy as np
import pytest

import pydriftless as dl


def drag(at):
    vx, vy = at.velocity("bar2", (0.6, 0))
    speed = np.sqrt(vx**2 + vy**2 + 1e-12)
    return -0.01 * speed * vx, -0.01 * speed * vy


def test_a_force_is_what_its_formula_is(free):
    ours = free.with_force("air", dl.on("bar2", 0.6, 0), drag)
    scene = free.to_dict()
    scene["points"] = [{"name": "tip", "body": "bar2", "point": [0.6, 0]}]
    scene["signals"] = {"speed": "sqrt(tip.vx^2 + tip.vy^2 + 1e-12)"}
    scene["forces"] = [
        {"name": "air", "body": "bar2", "point": [0.6, 0], "force": ["-0.01*speed*tip.vx", "-0.01*speed*tip.vy"]}
    ]
    theirs = dl.Scene.from_dict(scene)
    for method in ("taylor", "dp8", "radau9", "gauss8"):
        options = {"method": method, "until": 3, "step": 0.005 if method == "gauss8" else None}
        apart = ours.run(**options).rows - theirs.run(**options).rows
        assert np.abs(apart).max() < 1e-9, method
    lost = ours.run(until=3, trust="off")
    assert lost.energy_drift < 1e-8, "its work is accounted for"


def test_a_spring_is_the_built_in_one(scenes):
    spring = dl.load(scenes / "spring.json")
    scene = spring.to_dict()
    (built_in,) = scene.pop("springs")
    first, second = built_in["between"]
    stiffness, free_length = built_in["stiffness"], built_in["free_length"]
    bare = dl.Scene.from_dict(scene)
    pulled = bare.with_spring("own", first, second, lambda length, rate: stiffness * (length - free_length))
    kept = bare.with_potential("own", lambda at: 0.5 * stiffness * (distance(at, first, second) - free_length) ** 2)
    expected = spring.run(until=5, rtol=1e-12).rows[-1]
    for ours in (pulled, kept):
        found = ours.run(until=5, rtol=1e-12)
        names = [found.columns.index(f"bar{k}.{what}") for k in (1, 2) for what in ("phi", "omega")]
        theirs = [spring.run(until=0.1).columns.index(f"bar{k}.{what}") for k in (1, 2) for what in ("phi", "omega")]
        assert np.abs(found.rows[-1][names] - expected[theirs]).max() < 1e-9


def distance(at, first, second):
    def end(place):
        return place["point"] if place["body"] == "ground" else at.position(place["body"], place["point"])

    ends = end(first), end(second)
    return np.hypot(ends[0][0] - ends[1][0], ends[0][1] - ends[1][1])


def test_a_torque_with_a_switch_brakes_one_way(free):
    slowed = free.with_torque("brake", "bar1", lambda at: dl.where(at.omega("bar1") > 0, -0.05 * at.omega("bar1"), 0))
    text = free.to_dict()
    text["torques"] = [{"name": "brake", "body": "bar1", "torque": "if(bar1.omega > 0, -0.05*bar1.omega, 0)"}]
    theirs = dl.Scene.from_dict(text)
    apart = slowed.run(until=3, method="dp8").rows - theirs.run(until=3, method="dp8").rows
    assert np.abs(apart).max() < 1e-9
    same = free.with_torque("brake", "bar1", lambda at: np.where(at.omega("bar1") > 0, -0.05 * at.omega("bar1"), 0))
    assert same.to_dict() == slowed.to_dict()


def test_forces_pickle_sweep_and_are_set(free):
    driven = free.with_torque("push", "bar1", lambda at: 0.1 * np.cos(3 * at.t)).with_({"bar1.phi": 0.4})
    again = pickle.loads(pickle.dumps(driven))
    assert np.array_equal(again.run(until=1).rows, driven.run(until=1).rows)
    swept = driven.sweep({"bar1.phi": (0.1, 0.5, 5)}, until=1)
    assert len(swept) == 5


def test_long_functions_become_signals(free):
    def series(at):
        sum_, term = 0.0, 0.01 * at.phi("bar1")
        for _ in range(60):
            term = np.sin(term) * 1.01 + 0.001 * at.omega("bar2")
            sum_ = sum_ + term
        return -0.001 * sum_

    scene = free.with_torque("long", "bar1", series)
    assert len(scene.to_dict()["signals"]) > 5 and scene.run(until=1).success


@pytest.mark.parametrize(
    "torque, said",
    [
        (lambda at: 1.0 if at.phi("bar1") > 0 else -1.0, "pydriftless.where"),
        (lambda at: math.sin(at.phi("bar1")), "numpy's functions"),
        (lambda at: np.arcsin(at.phi("bar1")), "cannot use numpy.arcsin"),
        (lambda at: float("nan") * at.t, "number nan"),
        (lambda at: at.phi("bar3"), "there are bar1, bar2"),
        (lambda at: at.phi("bar1") if at.t else 0.0, "cannot ask for a value"),
        (lambda at: at.phi("bar1") if at.t == 0 else 0.0, "where with <"),
        (lambda at: dl.where(at.t != 0, at.phi("bar1"), 0.0), "where with <"),
    ],
)
def test_what_cannot_be_traced_says_so(free, torque, said):
    with pytest.raises((TypeError, ValueError, KeyError), match=said):
        free.with_torque("torque", "bar1", torque)


def twice(factor):
    def function(at):
        angle = np.sin(1.2345 * at.phi("bar1") + 0.321 * at.omega("bar1") + factor * at.t)
        return 0.01 * (angle * angle + angle * at.position("bar1", (0.1 * factor, 0))[0])

    return function


def test_signals_and_points_of_a_force_take_no_name_of_the_scene(free):
    scene = free.to_dict()
    scene["signals"] = {"x_1": "3*t"}
    scene["points"] = [{"name": "x_p1", "body": "bar2", "point": [0.1, 0]}]
    scene["torques"] = [{"name": "base", "body": "bar1", "torque": "0.01*(x_1 + 1*x_p1.x)"}]
    taken = dl.Scene.from_dict(scene)

    def both(scene, first, second):
        pushed = scene.with_torque(first, "bar1", twice(1.0))
        return pushed.with_force(second, dl.on("bar1", 0.6, 0), lambda at: (twice(2.0)(at), 0 * at.t))

    named = both(taken, "x", "x").run(until=1, trust="off")
    told_apart = both(taken, "y", "z").run(until=1, trust="off")
    assert np.array_equal(named.rows, told_apart.rows)
    assert both(taken, "x", "x").to_dict()["signals"]["x_1"] == "3*t"


def test_numbers_have_no_units(free):
    for torque in (lambda at: 0.25, lambda at: 0.1 * np.sin(at.phi("bar1")), lambda at: dl.where(at.t > 0.5, 0.1, 0.2)):
        assert free.with_torque("torque", "bar1", torque).run(until=0.1, trust="off").success
    fixed = free.with_force("force", dl.on("bar1", 0.6, 0), lambda at: (1.0, 0)).to_dict()["forces"]
    assert fixed[0]["force"] == [1.0, 0.0]


def test_sums_of_many_terms_are_not_too_deep(free):
    scene = free.with_torque("sum", "bar1", lambda at: sum(1e-4 * at.phi("bar1") * k for k in range(100)))
    assert scene.run(until=0.1, trust="off").success


def test_places_of_numpy(free):
    placed = free.with_force("push", dl.on("bar1", np.float32(0.5), np.int64(0)), lambda at: (at.t, 0))
    assert placed.to_dict()["forces"][0]["point"] == [0.5, 0.0]


def test_numpy_takes_symbols_by_its_declarations():
    import inspect

    names = list(inspect.signature(dl.Symbol.__array_ufunc__).parameters)
    assert names == ["self", "ufunc", "method", "inputs", "kwargs"]

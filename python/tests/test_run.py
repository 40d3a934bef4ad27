"""Runs: the program's numbers bit for bit, SciPy's habits, interruption."""

import copy
import json
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import pydriftless as dl
from conftest import record, table


@pytest.mark.parametrize(
    "name, options",
    [
        ("free", {"method": "taylor"}),
        ("motor", {"method": "dp8", "stabilize": "projection", "rtol": 1e-10}),
        ("four_bar_motor", {}),
        ("wall", {}),
        ("spring", {"method": "gauss8", "step": 0.01}),
        ("friction_pendulum", {}),
    ],
)
def test_numbers_are_those_of_the_program(scenes, program, tmp_path, name, options):
    flags = [word for key, value in options.items() for word in (f"--{key}", value)]
    code, _, said = program("run", scenes / f"{name}.json", "--until", 2, "--no-charts", "--out", tmp_path, *flags)
    assert code == 0, said
    (path,) = tmp_path.rglob("trajectory.csv")
    header, rows = table(path)
    run = dl.load(scenes / f"{name}.json").run(until=2, **options)
    assert run.success and run.message == "the horizon was reached"
    assert run.scene.columns == header
    # Shortest digits that read back to the same doubles: equal as words is equal as bits.
    assert np.array_equal(run.rows, np.array(rows, dtype=float))
    theirs, ours = record(path.parent / "run.json"), run.report
    for key in ("timings", "hashes"):
        theirs.pop(key), ours.pop(key)
    # How the scene was named on the command line.
    assert theirs.pop("given")["scene"].endswith(f"{name}.json")
    assert ours == theirs


def test_columns_are_views_of_one_block(free):
    run = free.run(until=3)
    assert np.shares_memory(run.t, run.rows) and np.shares_memory(run["bar2"].phi, run.rows)
    assert np.array_equal(run["bar2"].phi, run["bar2.phi"])
    assert run.units["bar2.omega"] == "rad/s" and set(run["bar1"]) == {"phi", "omega", "x", "y", "vx", "vy"}
    with pytest.raises(KeyError, match="bar3"):
        run["bar3"]
    with pytest.raises(AttributeError, match="there are phi"):
        run["bar2"].psi


def test_a_pendulum_swings_by_its_closed_form():
    scene = (
        dl.Builder("pendulum", gravity=(0, -9.81))
        .bar("bar", mass=1, centre=(0.5, 0), inertia=1 / 12, length=1)
        .hinge("A", dl.ground(0, 0), dl.on("bar", 0, 0))
        .start("bar", phi=-math.pi / 2 + 1.0, omega=0)
        .build(until=20, every=0.01)
    )
    run = scene.run(rtol=1e-13)
    # Period by the arithmetic-geometric mean; the frequency of small swings is sqrt(3 g / 2 l).
    a, b = 1.0, math.cos(0.5)
    for _ in range(8):
        a, b = (a + b) / 2, math.sqrt(a * b)
    period = 2 * math.pi / math.sqrt(1.5 * 9.81) / a
    at = run(np.array([0.0, period, 7 * period]))
    assert at.phi["bar"] == pytest.approx(-math.pi / 2 + 1.0, abs=1e-9)
    assert np.max(np.abs(at.omega["bar"])) < 1e-8
    assert run(period / 2).phi["bar"] == pytest.approx(-math.pi / 2 - 1.0, abs=1e-9)
    assert set(at.phi) == {"bar"}
    with pytest.raises(ValueError, match="outside"):
        run(21.0)


def test_dense_output_kept_or_made_later_is_the_same(scenes):
    scene = dl.load(scenes / "motor.json")
    times = np.linspace(0, 2, 37)
    kept, later = (scene.run(until=2, dense=dense)(times) for dense in (True, False))
    assert np.array_equal(kept.phi["bar2"], later.phi["bar2"])
    rows = scene.run(until=2)
    assert np.allclose(rows(rows.t).phi["bar2"], rows["bar2.phi"], rtol=0, atol=1e-12)


def test_a_stop_is_no_exception(scenes):
    run = dl.load(scenes / "free.json").run(until=50, max_evaluations=200)
    assert not run.success and "evaluations" in run.message
    assert 0 < run.t[-1] < 50


def test_refusals_say_where_and_what_to_do(scenes):
    with pytest.raises(dl.SceneRefused) as refused:
        dl.loads('{"name": "x",\n "gravity": [0, -9.81],\n "bars": [{"name": "a", "mass": -1}]}')
    assert refused.value.line == 3 and "mass" in refused.value.path and refused.value.hint
    with pytest.raises(dl.RequestRefused) as refused:
        dl.load(scenes / "drag.json").run(method="rattle4", step=0.01)
    assert refused.value.hint
    with pytest.raises(dl.RequestRefused, match='method = "euler"'):
        dl.load(scenes / "free.json").run(method="euler")
    with pytest.raises(dl.SceneRefused):
        dl.load(scenes / "free.json").with_({"bar1.mass": -2.0})
    with pytest.raises(dl.DriftlessError):
        dl.load(scenes / "free.json").with_({"bar1.colour": 3.0})
    with pytest.raises(TypeError):
        dl.load(scenes / "free.json").run(untill=3)


def test_other_values_make_another_scene(scenes):
    motor = dl.load(scenes / "motor.json")
    fast = motor.with_({"motor.rate": 3.0}).with_({"bar1.length": 0.5, "gravity": [0, -1.62]})
    assert motor.to_dict() != fast.to_dict() and fast.to_dict()["gravity"] == [0, -1.62]
    assert dl.load(scenes / "motor.json", set={"motor.rate": np.float64(3)}).run(until=1)["bar1.omega"] == pytest.approx(3.0)
    forces = motor.with_outputs("A.force", "half=motor.power/2").run(until=1)
    assert forces["half"] == pytest.approx(0.5 * forces["motor.power"], rel=1e-12, abs=1e-15)
    assert list(motor.run(until=1).motors) == ["motor"]


def test_scenes_pickle(scenes):
    scene = dl.load(scenes / "motor.json").with_({"motor.rate": 3.0}).with_outputs("A.force")
    again = pickle.loads(pickle.dumps(scene))
    assert np.array_equal(again.run(until=1).rows, scene.run(until=1).rows)


def test_a_callback_sees_every_row_and_can_end_the_run(free):
    seen = []
    run = free.run(until=1, every=0.1, callback=lambda t, row: seen.append((t, row.copy())))
    assert [t for t, _ in seen] == list(run.t)
    assert np.array_equal(np.array([row for _, row in seen]), run.rows)
    ended = free.run(until=1, every=0.1, callback=lambda t, row: t < 0.45)
    assert ended.t[-1] == pytest.approx(0.5) and ended.success and "callback" in ended.message

    def fails(t, row):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        free.run(until=1, callback=fails)


def test_a_stream_gives_the_rows_of_the_run(free):
    rows = free.stream(until=2, every=0.1)
    first = next(rows)
    assert first[0] == 0.0
    run = free.run(until=2, every=0.1, trust="off")
    assert np.array_equal(np.array([first, *rows]), run.rows)


def test_events_in_python_are_located_and_can_end_the_run(scenes):
    motor = dl.load(scenes / "motor.json")
    # The motor turns the first bar at one turn a second from a quarter on: it passes whole turns every second.
    whole = dl.Event("whole", lambda at: math.cos(at.phi("bar1")), direction=1)
    length = motor.to_dict()["bars"][0]["length"]
    low = dl.Event("low", lambda at: at.position("bar1", (length, 0))[0] - 0.5 * length, stop=True)
    run = motor.run(until=4, method="dp8", rtol=1e-12, events=[whole])
    assert [event["name"] for event in run.events] == ["whole"] * 4
    at = np.array([event["phi"]["bar1"] for event in run.events])
    assert np.max(np.abs(np.cos(at))) < 1e-9
    ended = motor.run(until=4, events=[low])
    assert ended.success and "event low" in ended.message and len(ended.events) == 1
    assert math.cos(ended.events[0]["phi"]["bar1"]) == pytest.approx(0.5, abs=1e-9)

    with pytest.raises(KeyError, match="bar9"):
        motor.run(until=4, events=[dl.Event("odd", lambda at: at.phi("bar9"))])


def test_the_lock_is_released(free):
    counted = 0
    done = threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    free.run(until=10, method="gauss8", step=0.001, trust="off")
    spent = time.perf_counter() - begin
    done.set()
    thread.join()
    assert counted > 20 * spent, (counted, spent)


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_an_interrupted_run_goes_on_from_its_checkpoint(tmp_path, scenes):
    code = f"""
import pydriftless as dl, signal, time
# Whoever started the tests may have them ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = dl.load({str(scenes / "free.json")!r})
try:
    print("going", flush=True)
    scene.run(until=20000, method="gauss8", step=0.001, every=1, trust="off")
except KeyboardInterrupt as stop:
    assert isinstance(stop, dl.Interrupted)
    open({str(tmp_path / "saved")!r}, "wb").write(stop.checkpoint)
    print(time.time(), flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "going\n"
    time.sleep(0.5)
    sent = time.time()
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert float(out) - sent < 1.0
    scene = dl.load(scenes / "free.json")
    run = dl.resume(tmp_path / "saved", callback=lambda t, row: t < 3)
    whole = scene.run(until=20000, method="gauss8", step=0.001, every=1, trust="off", callback=lambda t, row: t < 3)
    count = min(len(run.t), len(whole.t))
    assert count >= 3 and np.array_equal(run.rows[:count], whole.rows[:count])
    with pytest.raises(dl.RequestRefused):
        dl.resume(b"nonsense")


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_methods_of_one_long_call_are_interrupted_and_go_on(tmp_path, scenes, method):
    # One output interval is integrated in one call, which takes seconds.
    options = {"method": method, "until": 2000, "every": 1000, "rtol": 1e-10, "trust": "off"}
    code = f"""
import pydriftless as dl, signal, time
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = dl.load({str(scenes / "gentle.json")!r})
try:
    print("going", flush=True)
    scene.run(**{options!r})
except KeyboardInterrupt as stop:
    open({str(tmp_path / "saved")!r}, "wb").write(stop.checkpoint)
    print(time.time(), flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "going\n"
    time.sleep(0.2)
    sent = time.time()
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert float(out) - sent < 1.0
    run, whole = dl.resume(tmp_path / "saved"), dl.load(scenes / "gentle.json").run(**options)
    assert np.array_equal(run.rows, whole.rows) and run.report["result"] == whole.report["result"]


@pytest.mark.parametrize("kind", ["event", "callback"])
def test_ctrl_c_in_a_function_leaves_a_checkpoint(free, kind):
    asked = 0

    def asks():
        nonlocal asked
        asked += 1
        if asked == 45:
            signal.raise_signal(signal.SIGINT)

    def height(at):
        asks()
        return at.position("bar2", (0.6, 0))[1] + 0.5

    functions = {
        "event": {"events": [dl.Event("height", height)]},
        "callback": {"callback": lambda t, row: asks()},
    }[kind]
    options = {"until": 20, "every": 0.1, "method": "dp8", "rtol": 1e-9, "trust": "off"}
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(dl.Interrupted) as interrupted:
            free.run(**functions, **options)
    finally:
        signal.signal(signal.SIGINT, before)
    run, whole = dl.resume(interrupted.value.checkpoint, **functions), free.run(**functions, **options)
    assert np.array_equal(run.rows, whole.rows) and run.events == whole.events
    assert len(run.t) == 201 and (kind == "callback" or len(run.events) > 5)


def test_commands_of_the_program(scenes):
    crank = dl.load(scenes / "crank_rocker.json")
    assert crank.check()["scene"] == "crank_rocker"
    found = crank.kinematics(positions=36)
    assert len(found.pictures) == 2 and found.pictures["mechanism"].data.startswith(b"\x89PNG")
    assert "degrees_of_freedom" in dl.load(scenes / "free.json").modes(starts=0)
    at = dl.load(scenes / "free.json").with_({"bar1.phi": 0.1}).inspect(at=0.5)
    assert isinstance(at, dict) and at
    with pytest.raises(dl.DriftlessError):
        crank.kinematics(drive="nobody")


def test_charts(scenes):
    run = dl.load(scenes / "motor.json").run(until=2)
    assert run.charts == ["mechanism", "angles", "energy_drift", "torque_power"]
    assert run.chart("angles", "svg").data.startswith(b"<svg")
    assert run.animation().data.startswith(b"GIF89a")
    assert "image/png" in run._repr_mimebundle_()
    with pytest.raises(ValueError):
        run.chart("flowers")


def test_frames_and_datasets(free):
    run = free.run(until=1, every=0.1)
    pd = pytest.importorskip("pandas")
    frame = run.to_pandas()
    assert isinstance(frame, pd.DataFrame) and frame.attrs["units"]["bar1.phi"] == "rad"
    assert np.array_equal(frame["bar2.phi"].to_numpy(), run["bar2.phi"])
    pytest.importorskip("xarray")
    data = run.to_xarray()
    assert data["bar2.omega"].attrs["units"] == "rad/s" and np.array_equal(data["t"], run.t)


def test_plot(free):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = free.run(until=1).plot()
    assert axes.get_xlabel() == "time [s]" and axes.get_ylabel() == "[rad]" and len(axes.lines) == 2


def test_the_program_comes_along(program, tmp_path, scenes):
    code, out, _ = program("--version")
    assert code == 0 and out.split() == ["driftless", dl.__version__]
    assert program("run", "nothing.json")[0] == 6
    assert program("run", scenes / "free.json", "--rtol", "x")[0] == 2


def test_a_stream_tells_why_it_stopped(free):
    for option in ({"max_evaluations": 100}, {"max_energy_drift": 1e-16, "method": "dp8"}):
        stopped = free.run(until=20, trust="off", **option)
        rows = []
        with pytest.raises(dl.RequestRefused) as refused:
            for row in free.stream(until=20, **option):
                rows.append(row)
        assert str(refused.value).split(";")[0] in stopped.message
        assert np.array_equal(np.array(rows), stopped.rows)


@pytest.mark.parametrize("dense", [True, False])
def test_a_run_that_was_ended_says_nothing_beyond(free, dense):
    ended = free.run(until=2, every=0.1, dense=dense, trust="off", callback=lambda t, row: t < 0.45)
    assert ended(0.5).phi["bar1"] == pytest.approx(ended["bar1.phi"][-1], abs=1e-12)
    with pytest.raises(ValueError, match="outside of the run, 0 to 0.5 s"):
        ended(0.6)
    assert ended([]).phi["bar1"].shape == (0,)


def test_motion_of_a_run_within_wide_limits(free):
    options = {"method": "rattle2", "step": 0.04, "every": 0.2, "until": 2, "trust": "off"}
    run = free.run(max_energy_drift=10, max_constraint_drift=10, **options)
    assert run.success and not free.run(**options).success
    assert run(1.4).phi["bar1"] == pytest.approx(run["bar1.phi"][7], abs=1e-12)


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_resumed_run_is_asked_by_its_own_method(free):
    options = {"method": "dp8", "rtol": 1e-3, "every": 1.0, "trust": "off"}
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        main = threading.get_ident()
        threading.Timer(0.03, lambda: signal.pthread_kill(main, signal.SIGINT)).start()
        with pytest.raises(dl.Interrupted) as interrupted:
            free.run(until=1e5, max_energy_drift=1e9, **options)
    finally:
        signal.signal(signal.SIGINT, before)
    resumed = dl.resume(interrupted.value.checkpoint, callback=lambda t, row: False)
    assert resumed(0.7).phi == free.run(until=1, **options)(0.7).phi


@pytest.mark.parametrize("name", ["max_energy_drift", "max_constraint_drift", "max_evaluations"])
def test_limits_are_numbers_from_0_up(free, name):
    for limit in (-1.0, float("nan")):
        with pytest.raises(dl.RequestRefused, match=name):
            free.run(until=0.1, **{name: limit})
    with pytest.raises(TypeError, match=f"{name} is a number, not of type str"):
        free.run(until=0.1, **{name: "5"})


def test_exceptions_pickle(free):
    with pytest.raises(dl.SceneRefused) as refused:
        free.with_({"bar1.mass": -2.0})
    again = pickle.loads(pickle.dumps(refused.value))
    assert type(again) is dl.SceneRefused and vars(again) == vars(refused.value) and again.hint and again.path
    with pytest.raises(dl.RequestRefused) as refused:
        free.run(method="gauss6", rtol=1e-9)
    assert pickle.loads(pickle.dumps(refused.value)).hint == refused.value.hint
    stop = dl.Interrupted("interrupted")
    stop.checkpoint = b"checkpoint"
    assert pickle.loads(pickle.dumps(stop)).checkpoint == b"checkpoint"


def test_columns_are_copied_and_pickle(free):
    columns = free.run(until=0.1, trust="off")["bar2"]
    for again in (copy.copy(columns), copy.deepcopy(columns), pickle.loads(pickle.dumps(columns))):
        assert np.array_equal(again.phi, columns.phi)
    with pytest.raises(AttributeError, match="there are phi"):
        columns.mass


def test_commands_run_the_scene_as_it_was_loaded(tmp_path, free):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(free.to_dict()))
    loaded = dl.load(path)
    path.write_text(json.dumps({**free.to_dict(), "name": "changed"}))
    assert loaded.check()["scene"] == "free"


def test_tables_are_found_from_anywhere(tmp_path, free, monkeypatch):
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "gust.csv").write_text("0,0\n1,2.5\n3,0\n")
    scene = free.to_dict()
    scene["tables"] = {"gust": "gust.csv"}
    scene["torques"] = [{"name": "wind", "body": "bar1", "torque": "0.1*gust(t/1 s)"}]
    (tmp_path / "scenes" / "scene.json").write_text(json.dumps(scene))
    monkeypatch.chdir(tmp_path)
    loaded = dl.load("scenes/scene.json")
    rows = loaded.run(until=0.2, trust="off").rows
    pickled = pickle.dumps(loaded)
    forced = loaded.with_torque("none", "bar1", lambda at: 0 * at.t)
    monkeypatch.chdir("/")
    for again in (loaded.with_({"bar1.omega": 0}), pickle.loads(pickled), forced.with_({"bar1.omega": 0})):
        assert np.array_equal(again.run(until=0.2, trust="off").rows, rows)
    assert forced.check()["scene"] == "free"


def test_numbers_of_numpy_are_numbers(free):
    built = (
        dl.Builder("pendulum", gravity=np.array([0, -9.81]))
        .bar("bar", mass=np.int64(1), centre=np.array([0.5, 0]), inertia=np.float32(0.125), length=1)
        .hinge("A", dl.ground(0, 0), dl.on("bar", np.int64(0), np.float32(0)))
        .start("bar", phi=np.float64(0.3), omega=np.int32(0))
        .build(until=np.float32(2), every=0.1)
    )
    assert built.to_dict()["bars"][0]["inertia"] == 0.125
    assert free.inspect(at=np.float64(0.5)) == free.inspect(at=0.5)


def test_pictures_of_every_format_are_kept(free, monkeypatch):
    from pydriftless import _report

    # Drawing every mode takes seconds: here a program writes what is read.
    code = """if True:
        import pathlib, sys
        for name in ("mode1.gif", "mode1.svg", "mode1.png", "mode2.pdf"):
            pathlib.Path(sys.argv[-1], name).write_bytes(b"picture")
        print('{"scene": "free", "folder": "there"}')
    """
    monkeypatch.setattr(_report, "_PROGRAM", ["-c", code])
    found = free.modes(gif=True, chart_format=["png", "svg"])
    kinds = {name: picture.format for name, picture in found.pictures.items()}
    assert kinds == {"mode1": "png", "mode1.svg": "svg", "mode1.gif": "gif", "mode2": "pdf"} and dict(found) == {"scene": "free"}


def test_events_name_what_the_run_names(scenes):
    ball = dl.load(scenes / "sliding_ball.json")
    run = ball.run(until=0.2, trust="off", events=[dl.Event("half", lambda at: at.t - 0.1)])
    assert list(run.events[0]["phi"]) == list(run(0.1).phi) and "ball.x" in run.events[0]["phi"]


def test_only_false_ends_a_run(free):
    for answer in (0, "", [], None, np.True_):
        assert free.run(until=0.1, trust="off", callback=lambda t, row: answer).t[-1] == 0.1
    for answer in (False, np.False_):
        assert "callback" in free.run(until=0.1, trust="off", callback=lambda t, row: answer).message


def test_an_event_is_a_number(free):
    with pytest.raises(ValueError, match="event lost is not a number"):
        free.run(until=1, events=[dl.Event("lost", lambda at: float("nan"))])
    with pytest.raises(ValueError, match="event up: direction is -1, 0 or 1, not 5"):
        dl.Event("up", lambda at: at.t - 1, direction=5)


def test_wrong_words_name_what_there_is(free):
    with pytest.raises(TypeError, match="method is a word, not of type int"):
        free.run(method=5)
    run = free.run(until=0.1, trust="off")
    with pytest.raises(ValueError, match="there are mechanism, angles.* as png, svg"):
        run.chart("flowers")
    with pytest.raises(ValueError, match="gif or apng"):
        run.chart("angles", "jpg")


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_the_program_is_interrupted_without_a_traceback(tmp_path, scenes):
    words = ["-m", "pydriftless", "run", scenes / "free.json", "--until=1e6", "--every=1e3", "--quiet", "--out", tmp_path]
    # Whoever started the tests may have them ignore it.
    code = "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execv(sys.executable, sys.argv[1:])"
    child = subprocess.Popen([sys.executable, "-c", code, sys.executable, *map(str, words)], stderr=subprocess.PIPE, text=True)
    while child.poll() is None and not list(tmp_path.rglob("checkpoint")):
        time.sleep(0.01)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=60)
    assert child.returncode == 130 and "Traceback" not in said and "driftless resume" in said


def test_integrals_are_no_angles(scenes):
    pid = dl.load(scenes / "pid.json")
    run = pid.run(trust="off")
    bodies = {bar["name"] for bar in pid.to_dict()["bars"]}
    at = run(0.5 * run.t[-1])
    assert set(at.phi) == set(at.omega) == bodies
    half = run(run.t[3])
    assert all(half.omega[name] == pytest.approx(run[f"{name}.omega"][3], abs=1e-9) for name in bodies)
    described = [dl.Event("third", lambda at: at.t - 0.1)]
    event = pid.run(trust="off", events=described).events[0]
    assert set(event["phi"]) == set(event["omega"]) == bodies


def test_charts_and_numbers_that_are_none_are_refused(free):
    run = free.run(until=0.1, trust="off")
    for name in ("zzz", "angles"):
        with pytest.raises(ValueError, match="there is no chart"):
            run.chart(name, "gif")
    with pytest.raises(dl.RequestRefused, match="until is too large"):
        free.run(until=10**400)
    with pytest.raises(dl.RequestRefused, match="tells no report"):
        free.check(help=True)


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize("method", ["taylor", "dopri5"])
def test_a_stream_is_interrupted_within_a_row(free, method):
    rows = free.stream(until=1e5, every=1e5, method=method)
    next(rows)
    # Whoever started the tests may have them ignore it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        begin = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            next(rows)
        assert time.monotonic() - begin < 10
    finally:
        signal.signal(signal.SIGINT, before)

"""Ten tasks with heyoka.py, SciPy, exudyn and this package: lines of code, time, error, drift.

    pip install heyoka scipy exudyn ./python
    python python/benches/peers.py            # all; or the names of tasks

For every task and library the loosest setting that reaches the error asked for is looked for; its run is then
timed in turns with those of the others, and the median is told.  Lines are those of the functions below, without
comments and empty ones.  What a library builds once (equations, compiled code) is told apart from the run.
"""

import inspect
import math
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import pydriftless as dl

warnings.simplefilter("ignore")
SCENES = Path(__file__).resolve().parents[2] / "examples" / "scenes"

# The double pendulum: equal bars, gravity along +x.
L, G = 0.6, 9.81
M = 670 * L * 0.05 * 0.003
I = M * (L**2 + 0.05**2) / 12
A11, A22, A12 = M * L**2 / 4 + I + M * L**2, M * L**2 / 4 + I, M * L**2 / 2
SCALE = 2 * M * G * L
K, FREE = 7.5 * M * G / L, 2 * L / 3
DRAG = 0.5 * 1.2 * 1.1 * 0.01


def energy(p1, p2, w1, w2):
    """Energy of the double pendulum [J]."""
    kinetic = (A11 * w1**2 + A22 * w2**2) / 2 + A12 * np.cos(p1 - p2) * w1 * w2
    return kinetic - M * G * L * (1.5 * np.cos(p1) + 0.5 * np.cos(p2))


@dataclass
class Found:
    """What one run came to: values to compare, drift, time of building and of running [s]."""

    values: np.ndarray
    run: float
    build: float = 0.0
    drift: float | None = None


@dataclass
class Task:
    """A task: what is asked, by which error, and how each library does it at its settings."""

    what: str
    error: float
    settings: dict[str, list[float]]
    ways: dict[str, Callable[[float], Found]]
    shared: dict[str, list[Callable]] = field(default_factory=dict)


def clocked(function):
    """A result, and the processor time it took [s]: other work on the machine is not counted."""
    begin = time.process_time()
    result = function()
    return result, time.process_time() - begin


# --- this package -------------------------------------------------------------------------------------------


def own(scene, until, tolerance, **options):
    run, took = clocked(lambda: scene.run(until=until, rtol=tolerance, trust="off", **options))
    return run, took


def own_ends(name, until, every=None, method="taylor"):
    def way(tolerance):
        scene, build = clocked(lambda: dl.load(SCENES / f"{name}.json"))
        run, took = own(scene, until, tolerance, every=every or until, method=method)
        return Found(np.array([run["bar1"].phi[-1], run["bar2"].phi[-1]]), took, build, run.energy_drift)

    return way


def own_drag(tolerance):
    def air(at):
        vx, vy = at.velocity("bar2", (L, 0))
        speed = np.sqrt(vx**2 + vy**2 + 1e-12)
        return -DRAG * speed * vx, -DRAG * speed * vy

    scene, build = clocked(lambda: dl.load(SCENES / "free.json").with_force("air", dl.on("bar2", L, 0), air))
    run, took = own(scene, 10, tolerance, every=10, method="taylor")
    return Found(np.array([run["bar1"].phi[-1], run["bar2"].phi[-1]]), took, build)


def own_motor(tolerance):
    scene, build = clocked(lambda: dl.load(SCENES / "motor.json").with_({"motor.rate": 2 * math.pi}))
    run, took = own(scene, 5, tolerance, every=5, method="taylor")
    return Found(np.array([run["bar2"].phi[-1], run.motors["motor"].torque[-1]]), took, build)


def own_events(tolerance):
    scene, build = clocked(lambda: dl.load(SCENES / "free.json"))
    event = dl.Event("down", lambda at: math.sin(at.phi("bar1")))
    run, took = own(scene, 10, tolerance, every=10, method="taylor", events=[event])
    return Found(np.array([event["t"] for event in run.events if event["name"] == "down"]), took, build)


def own_sweep(tolerance):
    scene, build = clocked(lambda: dl.load(SCENES / "free.json"))
    grid = {"bar1.phi": (-0.5, 0.5, 1000)}
    swept, took = clocked(lambda: scene.sweep(grid, until=10, rtol=tolerance, threads=1))
    return Found(np.array([swept["bar1.phi"], swept["bar2.phi"]]).T, took, build)


def own_chain(tolerance):
    scene, build = clocked(lambda: dl.load(SCENES / "chain8.json"))
    run, took = own(scene, 3, tolerance, every=3, method="taylor")
    return Found(np.array([run[f"bar{k}"].phi[-1] for k in range(1, 9)]), took, build)


def own_four_bar(tolerance):
    builder = dl.Builder("loop")
    for name, length in (("crank", 0.3), ("coupler", 0.8), ("rocker", 0.7)):
        builder.bar(name, mass=length, centre=(length / 2, 0), inertia=length**3 / 12, length=length)
    builder.hinge("O", dl.ground(0, 0), dl.on("crank", 0, 0))
    builder.hinge("A", dl.on("crank", 0.3, 0), dl.on("coupler", 0, 0))
    builder.hinge("B", dl.on("coupler", 0.8, 0), dl.on("rocker", 0.7, 0))
    builder.hinge("C", dl.ground(1, 0), dl.on("rocker", 0, 0))
    builder.start("crank", phi=math.pi / 2, omega=0)
    a, b = four_bar_angles(math.pi / 2)
    builder.set(start={"crank": {"phi": math.pi / 2, "omega": 0}, "coupler": {"phi": a}, "rocker": {"phi": b}})
    scene, build = clocked(lambda: builder.build(until=5, every=5))
    run, took = own(scene, 5, tolerance)
    return Found(np.array([run["crank"].phi[-1]]), took, build, run.energy_drift)


# --- SciPy --------------------------------------------------------------------------------------------------


def scipy_rates(t, y, torque=lambda t, y: (0.0, 0.0)):
    p1, p2, w1, w2 = y
    s, c = math.sin(p1 - p2), math.cos(p1 - p2)
    t1, t2 = torque(t, y)
    b1 = -A12 * s * w2**2 - 1.5 * M * G * L * math.sin(p1) + t1
    b2 = A12 * s * w1**2 - 0.5 * M * G * L * math.sin(p2) + t2
    det = A11 * A22 - (A12 * c) ** 2
    return w1, w2, (A22 * b1 - A12 * c * b2) / det, (A11 * b2 - A12 * c * b1) / det


def scipy_run(until, tolerance, rates=scipy_rates, start=(math.pi / 2, math.pi / 2, 0, 0), **options):
    from scipy.integrate import solve_ivp

    options = {"method": "DOP853", "rtol": tolerance, "atol": tolerance, **options}
    return clocked(lambda: solve_ivp(rates, (0, until), start, **options))


def scipy_free(until):
    def way(tolerance):
        found, took = scipy_run(until, tolerance)
        drift = np.abs(energy(*found.y) - energy(*found.y[:, 0])).max() / SCALE
        return Found(found.y[:2, -1], took, drift=drift)

    return way


def scipy_spring(tolerance):
    def pull(t, y):
        x, yy = FREE * math.cos(y[0]) + L / 2, FREE * math.sin(y[0])
        length = math.hypot(x, yy)
        force = -K * (length - FREE) / length
        return force * FREE * (yy * math.cos(y[0]) - x * math.sin(y[0])), 0.0

    found, took = scipy_run(10, tolerance, lambda t, y: scipy_rates(t, y, pull))
    return Found(found.y[:2, -1], took)


def scipy_drag(tolerance):
    def air(t, y):
        (s1, c1), (s2, c2) = ((math.sin(p), math.cos(p)) for p in y[:2])
        vx, vy = -L * (y[2] * s1 + y[3] * s2), L * (y[2] * c1 + y[3] * c2)
        fx, fy = (-DRAG * math.sqrt(vx**2 + vy**2 + 1e-12) * v for v in (vx, vy))
        return L * (c1 * fy - s1 * fx), L * (c2 * fy - s2 * fx)

    found, took = scipy_run(10, tolerance, lambda t, y: scipy_rates(t, y, air))
    return Found(found.y[:2, -1], took)


def scipy_motor(tolerance):
    rate, inertia = 2 * math.pi, M * L**2 / 12
    a11, a22 = M * L**2 / 4 + inertia + M * L**2, M * L**2 / 4 + inertia

    def rates(t, y):
        p1 = math.pi / 2 + rate * t
        return y[1], (A12 * math.sin(p1 - y[0]) * rate**2 - 0.5 * M * G * L * math.sin(y[0])) / a22

    found, took = scipy_run(5, tolerance, rates, (math.pi / 2, rate))
    (p2, w2), p1 = found.y[:, -1], math.pi / 2 + 5 * rate
    alpha = rates(5, (p2, w2))[1]
    weight = 1.5 * M * G * L * math.sin(p1)
    torque = A12 * (math.cos(p1 - p2) * alpha + math.sin(p1 - p2) * w2**2) + weight
    return Found(np.array([p2, torque]), took)


def scipy_events(tolerance):
    found, took = scipy_run(10, tolerance, events=lambda t, y: math.sin(y[0]))
    return Found(found.t_events[0], took)


def scipy_sweep(tolerance):
    starts = [(phi, math.pi / 2, 0, 0) for phi in np.linspace(-0.5, 0.5, 1000)]
    ends, took = clocked(lambda: [scipy_run(10, tolerance, start=start)[0].y[:2, -1] for start in starts])
    return Found(np.array(ends), took)


def scipy_chain(tolerance):
    n = 8
    scene = dl.load(SCENES / "chain8.json").to_dict()
    starts = [scene["start"][f"bar{k}"] for k in range(1, n + 1)]
    mass, inertia, length = chain_bar()
    below = np.array([n - 1 - k + 0.5 for k in range(n)]) * mass * length
    pairs = mass * length**2 * np.array([[n - 1 - max(i, j) + 0.5 for j in range(n)] for i in range(n)])
    np.fill_diagonal(pairs, [mass * length**2 * (n - 1 - k + 0.25) + inertia for k in range(n)])

    def rates(t, y):
        apart = y[:n, None] - y[None, :n]
        load = -(pairs * np.sin(apart)) @ y[n:] ** 2 - G * below * np.sin(y[:n])
        return np.concatenate((y[n:], np.linalg.solve(pairs * np.cos(apart), load)))

    start = [one["phi"] for one in starts] + [one["omega"] for one in starts]
    found, took = scipy_run(3, tolerance, rates, start)
    return Found(found.y[:n, -1], took)


def four_bar_angles(crank):
    """Coupler and rocker of a four-bar by the intersection of two circles."""
    ax, ay = 0.3 * math.cos(crank), 0.3 * math.sin(crank)
    dx, dy = 1 - ax, -ay
    d2 = dx * dx + dy * dy
    along = (0.8**2 - 0.7**2 + d2) / (2 * d2)
    off = math.sqrt(0.8**2 / d2 - along**2)
    bx, by = ax + along * dx - off * dy, ay + along * dy + off * dx
    return math.atan2(by - ay, bx - ax), math.atan2(by, bx - 1)


def scipy_four_bar(tolerance):
    lengths = np.array([0.3, 0.8, 0.7])
    a, c, r = lengths
    mass = np.diag(lengths**3 / 3)
    mass[0, 0] += c * a**2

    def rates(t, y):
        s, k, w = np.sin(y[:3]), np.cos(y[:3]), y[3:]
        full, half = mass.copy(), c * a * c / 2
        full[0, 1] = full[1, 0] = half * math.cos(y[0] - y[1])
        load = -G * k * np.array([a * a / 2 + c * a, c * c / 2, r * r / 2])
        load[0] -= half * math.sin(y[0] - y[1]) * w[1] ** 2
        load[1] += half * math.sin(y[0] - y[1]) * w[0] ** 2
        signed = lengths * [1, 1, -1]
        rows = np.array([-signed * s, signed * k])
        system = np.block([[full, rows.T], [rows, np.zeros((2, 2))]])
        right = np.concatenate((load, [(signed * k) @ w**2, (signed * s) @ w**2]))
        return np.concatenate((w, np.linalg.solve(system, right)[:3]))

    start = (math.pi / 2, *four_bar_angles(math.pi / 2), 0, 0, 0)
    found, took = scipy_run(5, tolerance, rates, start)
    return Found(found.y[:1, -1], took)


# --- heyoka.py ----------------------------------------------------------------------------------------------


def heyoka_system(torque=lambda hy, p1, p2, w1, w2: (0.0, 0.0)):
    import heyoka as hy

    p1, p2, w1, w2 = hy.make_vars("p1", "p2", "w1", "w2")
    s, c = hy.sin(p1 - p2), hy.cos(p1 - p2)
    t1, t2 = torque(hy, p1, p2, w1, w2)
    b1 = -A12 * s * w2**2.0 - 1.5 * M * G * L * hy.sin(p1) + t1
    b2 = A12 * s * w1**2.0 - 0.5 * M * G * L * hy.sin(p2) + t2
    det = A11 * A22 - (A12 * c) ** 2.0
    return [(p1, w1), (p2, w2), (w1, (A22 * b1 - A12 * c * b2) / det), (w2, (A11 * b2 - A12 * c * b1) / det)]


def heyoka_run(until, tolerance, system, start=(math.pi / 2, math.pi / 2, 0.0, 0.0), **options):
    import heyoka as hy

    make = lambda: hy.taylor_adaptive(system, list(start), tol=tolerance, **options)  # noqa: E731
    integrator, build = clocked(make)
    _, took = clocked(lambda: integrator.propagate_until(until, max_steps=10**7))
    return integrator, took, build


def heyoka_free(until):
    def way(tolerance):
        integrator, took, build = heyoka_run(until, tolerance, heyoka_system())
        drift = abs(energy(*integrator.state) - energy(math.pi / 2, math.pi / 2, 0, 0)) / SCALE
        return Found(integrator.state[:2].copy(), took, build, drift)

    return way


def heyoka_spring(tolerance):
    def pull(hy, p1, p2, w1, w2):
        x, y = FREE * hy.cos(p1) + L / 2, FREE * hy.sin(p1)
        length = hy.sqrt(x**2.0 + y**2.0)
        force = -K * (length - FREE) / length
        return force * FREE * (y * hy.cos(p1) - x * hy.sin(p1)), 0.0

    integrator, took, build = heyoka_run(10, tolerance, heyoka_system(pull))
    return Found(integrator.state[:2].copy(), took, build)


def heyoka_drag(tolerance):
    def air(hy, p1, p2, w1, w2):
        vx, vy = -L * (w1 * hy.sin(p1) + w2 * hy.sin(p2)), L * (w1 * hy.cos(p1) + w2 * hy.cos(p2))
        fx, fy = (-DRAG * hy.sqrt(vx**2.0 + vy**2.0 + 1e-12) * v for v in (vx, vy))
        return L * (hy.cos(p1) * fy - hy.sin(p1) * fx), L * (hy.cos(p2) * fy - hy.sin(p2) * fx)

    integrator, took, build = heyoka_run(10, tolerance, heyoka_system(air))
    return Found(integrator.state[:2].copy(), took, build)


def heyoka_motor(tolerance):
    import heyoka as hy

    rate, inertia = 2 * math.pi, M * L**2 / 12
    a22 = M * L**2 / 4 + inertia
    p2, w2 = hy.make_vars("p2", "w2")
    p1 = math.pi / 2 + rate * hy.time
    alpha = (A12 * hy.sin(p1 - p2) * rate**2 - 0.5 * M * G * L * hy.sin(p2)) / a22
    integrator, took, build = heyoka_run(5, tolerance, [(p2, w2), (w2, alpha)], (math.pi / 2, rate))
    (p2, w2), p1 = integrator.state, math.pi / 2 + 5 * rate
    alpha = (A12 * math.sin(p1 - p2) * rate**2 - 0.5 * M * G * L * math.sin(p2)) / a22
    weight = 1.5 * M * G * L * math.sin(p1)
    torque = A12 * (math.cos(p1 - p2) * alpha + math.sin(p1 - p2) * w2**2) + weight
    return Found(np.array([p2, torque]), took, build)


def heyoka_events(tolerance):
    import heyoka as hy

    times = []
    event = hy.nt_event(hy.sin(hy.make_vars("p1")), lambda integrator, t, sign: times.append(t))
    _, took, build = heyoka_run(10, tolerance, heyoka_system(), nt_events=[event])
    return Found(np.array(times), took, build)


def heyoka_sweep(tolerance):
    import heyoka as hy

    starts = np.array([(phi, math.pi / 2, 0, 0) for phi in np.linspace(-0.5, 0.5, 1000)])
    ends = []
    first = np.ascontiguousarray(starts[:4].T)
    integrator, build = clocked(lambda: hy.taylor_adaptive_batch(heyoka_system(), first, tol=tolerance))

    def all_of_them():
        for begin in range(0, 1000, 4):
            integrator.set_time([0.0] * 4)
            integrator.state[:] = starts[begin : begin + 4].T
            integrator.propagate_until([10.0] * 4)
            ends.extend(integrator.state[:2].T.copy())

    _, took = clocked(all_of_them)
    return Found(np.array(ends), took, build)


# --- exudyn -------------------------------------------------------------------------------------------------


def exudyn_tree(masses, inertias, lengths, start, until, tolerance, every=None):
    import exudyn as exu
    from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree, SensorNode

    n = len(masses)
    mbs = exu.SystemContainer().AddSystem()
    relative = np.diff([0, *start])
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n,
            initialCoordinates=relative,
            initialCoordinates_t=[0.0] * n,
            numberOfODE2Coordinates=n,
        )
    )
    mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ] * n,
            linkParents=list(range(-1, n - 1)),
            jointTransformations=exu.Matrix3DList([np.eye(3)] * n),
            jointOffsets=exu.Vector3DList([[length, 0, 0] for length in [0, *lengths[:-1]]]),
            linkInertiasCOM=exu.Matrix3DList([np.diag([0, 0, inertia]) for inertia in inertias]),
            linkCOMs=exu.Vector3DList([[length / 2, 0, 0] for length in lengths]),
            linkMasses=list(masses),
            gravity=[G, 0, 0],
        )
    )
    kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
    sensors = [
        mbs.AddSensor(SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)) for kind in kinds
    ]
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = until
    settings.timeIntegration.numberOfSteps = int(until / 0.01)
    settings.timeIntegration.absoluteTolerance = settings.timeIntegration.relativeTolerance = tolerance
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = every or until
    _, took = clocked(lambda: mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.DOPRI5))
    angles, rates = (np.cumsum(mbs.GetSensorStoredData(sensor)[:, 1:], axis=1) for sensor in sensors)
    return angles, rates, took


def exudyn_free(until, every=None):
    def way(tolerance):
        pendulum = [M] * 2, [I] * 2, [L] * 2, [math.pi / 2] * 2
        (angles, rates, took), all_of_it = clocked(lambda: exudyn_tree(*pendulum, until, tolerance, every))
        all_energy = energy(*angles.T, *rates.T)
        return Found(angles[-1], took, all_of_it - took, np.abs(all_energy - all_energy[0]).max() / SCALE)

    return way


def exudyn_chain(tolerance):
    scene = dl.load(SCENES / "chain8.json").to_dict()
    start = [scene["start"][f"bar{k}"]["phi"] for k in range(1, 9)]
    mass, inertia, length = chain_bar()
    chain = [mass] * 8, [inertia] * 8, [length] * 8, start
    (angles, _, took), all_of_it = clocked(lambda: exudyn_tree(*chain, 3, tolerance))
    return Found(angles[-1], took, all_of_it - took)


def exudyn_four_bar(step):
    import exudyn as exu
    from exudyn import itemInterface as items

    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    a, b = four_bar_angles(math.pi / 2)
    origins = [(0, 0), (0, 0.3), (1, 0)]
    bodies, nodes = [ground], []
    for (x, y), angle, length in zip(origins, (math.pi / 2, a, b), (0.3, 0.8, 0.7), strict=True):
        at = [x + length / 2 * math.cos(angle), y + length / 2 * math.sin(angle), angle]
        nodes.append(mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=at)))
        bodies.append(
            mbs.AddObject(
                items.ObjectRigidBody2D(physicsMass=length, physicsInertia=length**3 / 12, nodeNumber=nodes[-1])
            )
        )
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=bodies[-1]))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0, -G, 0]))
    joints = [(0, [0, 0, 0], 1, -0.15), (1, 0.15, 2, -0.4), (2, 0.4, 3, 0.35), (0, [1, 0, 0], 3, -0.35)]
    for first, here, second, there in joints:
        ends = [(first, here), (second, there)]
        markers = [
            mbs.AddMarker(
                items.MarkerBodyPosition(
                    bodyNumber=bodies[body], localPosition=place if isinstance(place, list) else [place, 0, 0]
                )
            )
            for body, place in ends
        ]
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=markers))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 5
    settings.timeIntegration.numberOfSteps = round(5 / step)
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-12
    settings.solutionSettings.writeSolutionToFile = False
    _, took = clocked(
        lambda: mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    )
    # Coordinates are counted from the reference configuration.
    return Found(mbs.GetNodeOutput(nodes[0], exu.OutputVariableType.Coordinates)[2:3] + math.pi / 2, took)


# --- tasks --------------------------------------------------------------------------------------------------


def chain_bar():
    """Mass, inertia and length of a bar of the chain."""
    scene = dl.load(SCENES / "chain8.json").to_dict()
    bar = scene["bars"][0]
    return bar["mass"], bar["inertia"], bar["length"]


def tenths(first, last):
    """Tolerances from loose to tight."""
    return [10.0**-k for k in range(first, last + 1)]


def pendulum_task(what, error, until, finest=15, every=None):
    return Task(
        what,
        error,
        {
            "pydriftless": tenths(6, finest + 2),
            "SciPy": tenths(6, 13),
            "heyoka.py": tenths(6, finest),
            "exudyn": tenths(6, 12),
        },
        {
            "pydriftless": own_ends("free", until),
            "SciPy": scipy_free(until),
            "heyoka.py": heyoka_free(until),
            "exudyn": exudyn_free(until, every),
        },
        {
            "SciPy": [scipy_rates, scipy_run],
            "heyoka.py": [heyoka_system, heyoka_run],
            "exudyn": [exudyn_tree],
            "pydriftless": [own],
        },
    )


def bound_task(what, error, ways, last=13):
    uses = {
        "SciPy": [scipy_run, scipy_rates],
        "heyoka.py": [heyoka_run, heyoka_system],
        "pydriftless": [own],
        "exudyn": [exudyn_tree],
    }
    finest = {"SciPy": 13, "exudyn": 12}
    return Task(what, error, {name: tenths(6, finest.get(name, last)) for name in ways}, ways, uses)


TASKS = {
    "free6": pendulum_task("double pendulum, 10 s, angles to 1e-6", 1e-6, 10),
    "free10": pendulum_task("the same to 1e-10", 1e-10, 10),
    "drift": pendulum_task("the same for 1000 s, energy to 1e-11", 1e-11, 1000, every=0.1),
    "spring": bound_task(
        "with a spring, 10 s, to 1e-9",
        1e-9,
        {"pydriftless": own_ends("spring", 10), "SciPy": scipy_spring, "heyoka.py": heyoka_spring},
        16,
    ),
    "drag": bound_task(
        "with drag of air on its tip, 10 s, to 1e-9",
        1e-9,
        {"pydriftless": own_drag, "SciPy": scipy_drag, "heyoka.py": heyoka_drag},
        16,
    ),
    "motor": bound_task(
        "driven by a motor, 5 s, angle and torque to 1e-8",
        1e-8,
        {"pydriftless": own_motor, "SciPy": scipy_motor, "heyoka.py": heyoka_motor},
        16,
    ),
    "events": bound_task(
        "times of all passages through the vertical in 10 s, to 1e-8",
        1e-8,
        {"pydriftless": own_events, "SciPy": scipy_events, "heyoka.py": heyoka_events},
        16,
    ),
    "sweep": bound_task(
        "1000 starts of 10 s, on one thread, to 1e-6",
        1e-6,
        {"pydriftless": own_sweep, "SciPy": scipy_sweep, "heyoka.py": heyoka_sweep},
        13,
    ),
    "chain": bound_task(
        "a chain of eight bars, 3 s, to 1e-8",
        1e-8,
        {"pydriftless": own_chain, "SciPy": scipy_chain, "exudyn": exudyn_chain},
        15,
    ),
    "loop": bound_task(
        "a four-bar swinging, 5 s, to 1e-7",
        1e-7,
        {"pydriftless": own_four_bar, "SciPy": scipy_four_bar, "exudyn": exudyn_four_bar},
        15,
    ),
}
TASKS["loop"].settings["exudyn"] = [1e-2, 1e-3, 1e-4]
# One thousand starts take SciPy minutes, and so do 1000 s; none of its tolerances reaches what is asked there.
TASKS["sweep"].settings["SciPy"] = [1e-10]
TASKS["drift"].settings["SciPy"] = [1e-12, 1e-13]
TASKS["drift"].settings["exudyn"] = [1e-11, 1e-12]


def reference(task):
    """The finest result of this package and of another library, and how far they are apart."""
    ends = [task.ways[name](task.settings[name][-1]).values for name in ("pydriftless", "SciPy")]
    if "heyoka.py" in task.ways:
        # Below the spacing of doubles its steps are wrong.
        ends[1] = task.ways["heyoka.py"](1e-15).values
    return ends[1], float(np.abs(ends[0] - ends[1]).max())


def lines(function):
    text = inspect.getsource(function).splitlines()
    return sum(bool(line.strip()) and not line.strip().startswith(("#", '"""')) for line in text)


def tell(name, task):
    known, apart = (None, 0.0) if name == "drift" else reference(task)

    def off(found):
        if known is None:
            return found.drift
        if found.values.shape != known.shape:
            return math.inf
        return float(np.abs(found.values - known).max())

    chosen = {}
    for library, settings in task.settings.items():
        for setting in settings:
            found = task.ways[library](setting)
            if off(found) <= task.error:
                break
        chosen[library] = setting
    print(f"\n{name}: {task.what}" + (f" (references agree to {apart:.0e})" if known is not None else ""))
    slow = any(task.ways[library](setting).run > 10 for library, setting in chosen.items())
    rounds = 1 if slow else 5
    runs = {library: [] for library in chosen}
    for _ in range(rounds):
        for library, setting in chosen.items():
            runs[library].append(task.ways[library](setting))
    for library, found in runs.items():
        took = statistics.median(one.run for one in found)
        build = statistics.median(one.build for one in found)
        count = lines(task.ways[library]) + sum(lines(one) for one in task.shared.get(library, []))
        drift = found[0].drift
        drift = "" if drift is None else f"{drift:.0e}"
        reached = off(found[0])
        note = "" if reached <= task.error else "not reached"
        row = [name, library, f"{chosen[library]:.0e}", count, f"{build * 1e3:.3g}", f"{took * 1e3:.3g}"]
        print("| " + " | ".join(map(str, [*row, f"{reached:.0e}", drift, note])) + " |", flush=True)


if __name__ == "__main__":
    for one in sys.argv[1:] or TASKS:
        tell(one, TASKS[one])

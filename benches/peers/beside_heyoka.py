#!/usr/bin/env python3
"""Time at equal true error beside heyoka, in alternating runs.

Run by hand from the root of the repository: `python3 benches/peers/beside_heyoka.py [SCENE...]`.  Makes a virtual environment in
`target/peers`, installs heyoka from PyPI there, builds `cargo bench --bench rivals` and talks to it line by line.  Both codes get the same
constants, the same sixteen starts and the same judge: the geometric mean over the starts of the largest error in an angle or a rate at the end, against a
double-double run.  Each code's cheapest setting below the target is timed, the two in turn; times are microseconds per simulated second and trajectory.

heyoka: F. Biscani, D. Izzo, MNRAS 504 (2021) 2614.  It chooses its order from the tolerance.  Released from rest exactly at the horizontal, `free` has only
every fourth coefficient, and heyoka 7.13 takes a first step of 0.74 s there, far outside the circle of convergence; the starts compared are turned by up to half a milliradian.
"""

import json
import math
import subprocess
import sys
import time

from environment import ROOT, prepare

BLOCKS = 15
CASES = [
    ("free", 1e-6),
    ("free", 1e-9),
    ("gentle", 1e-12),
    ("spring", 1e-9),
    ("motor", 1e-9),
    ("motor_sine", 1e-9),
    ("chain3", 1e-7),
    ("chain6", 1e-8),
]


class Driftless:
    """The bench, answering."""

    def __init__(self):
        bench = ["cargo", "bench", "--quiet", "--no-default-features", "--bench", "rivals"]
        subprocess.run([*bench, "--no-run"], cwd=ROOT, check=True)
        self.child = subprocess.Popen([*bench, "--", "--serve"], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, *words):
        self.child.stdin.write(" ".join(map(str, words)) + "\n")
        self.child.stdin.flush()
        answer = json.loads(self.child.stdout.readline())
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer


class Ours:
    """One of our codes on the problem at hand."""

    def __init__(self, driftless, code, order):
        self.name = f"driftless, {'one by one' if code == 'taylor' else 'in lanes'}, order {order}"
        self.ask = lambda tolerance: driftless.ask("time", code, order, repr(tolerance))

    def run(self, tolerance):
        answer = self.ask(tolerance)
        return answer["mean_error"], answer["us"]


class Heyoka:
    """heyoka on the problem at hand, one by one or a batch at a time."""

    def __init__(self, problem, batch):
        import heyoka

        self.heyoka, self.problem, self.batch = heyoka, problem, batch
        self.name = "heyoka, one by one" if batch == 1 else f"heyoka, batches of {batch}"
        self.made = {}

    def equations(self):
        hy, problem = self.heyoka, self.problem
        diagonal, weight, coupling = (problem[name] for name in ("diagonal", "weight", "coupling"))
        n = len(diagonal)
        if problem["motors"]:
            # Body 1 turns by a law of time: one equation is left.
            (law,) = problem["motors"]
            p, v = hy.make_vars("p", "v")
            driven, rate, acceleration = law["start"] + law["rate"] * hy.time, law["rate"], 0.0
            for amplitude, frequency, phase in law["sines"]:
                argument = frequency * hy.time + phase
                driven += amplitude * hy.sin(argument)
                rate += amplitude * frequency * hy.cos(argument)
                acceleration -= amplitude * frequency**2 * hy.sin(argument)
            pull = rate * rate * hy.sin(driven - p)
            if law["sines"]:
                pull -= acceleration * hy.cos(driven - p)
            return [(p, v), (v, (coupling[1] * pull - weight[1] * hy.sin(p)) / diagonal[1])]
        p, v = ([hy.make_vars(f"{name}{i}") for i in range(n)] for name in "pv")
        sin, a = {}, {}
        mass = [[None] * n for _ in range(n)]
        for i in range(n):
            mass[i][i] = diagonal[i]
            for j in range(i + 1, n):
                a[i, j] = a[j, i] = coupling[i * n + j]
                sin[i, j] = hy.sin(p[i] - p[j])
                sin[j, i] = -sin[i, j]
                mass[i][j] = mass[j][i] = a[i, j] * hy.cos(p[i] - p[j])
        rates = [
            hy.sum([-weight[i] * hy.sin(p[i])] + [-a[i, j] * sin[i, j] * v[j] * v[j] for j in range(n) if j != i]) for i in range(n)
        ]
        for spring in problem["springs"]:
            # Its length over the angle of the first bar: L^2 = fixed + 2 (across cos p + along sin p).
            (ground_x, ground_y), (x, y) = spring["points"]
            fixed = ground_x**2 + ground_y**2 + x**2 + y**2
            across, along = -(ground_x * x + ground_y * y), ground_x * y - ground_y * x
            cos, sine = hy.cos(p[0]), hy.sin(p[0])
            length = hy.sqrt(fixed + 2.0 * (across * cos + along * sine))
            rates[0] = rates[0] - spring["stiffness"] * (1.0 - spring["free_length"] / length) * (along * cos - across * sine)
        # Elimination without pivoting, as the mass matrix is positive definite; each factor is one expression.
        for k in range(n):
            for i in range(k + 1, n):
                factor = mass[i][k] / mass[k][k]
                rates[i] = rates[i] - factor * rates[k]
                for j in range(k + 1, i + 1):
                    mass[i][j] = mass[j][i] = mass[i][j] - factor * mass[k][j]
        for k in reversed(range(n)):
            rates[k] = hy.sum([rates[k]] + [-mass[k][j] * rates[j] for j in range(k + 1, n)]) / mass[k][k]
        return list(zip(p + v, v + rates))

    def integrator(self, tolerance, width):
        import numpy

        if tolerance not in self.made:
            if self.batch == 1:
                self.made[tolerance] = self.heyoka.taylor_adaptive(self.equations(), [0.0] * width, tol=tolerance)
            else:
                zeros = numpy.zeros((width, self.batch))
                self.made[tolerance] = self.heyoka.taylor_adaptive_batch(self.equations(), zeros, tol=tolerance)
        return self.made[tolerance]

    def run(self, tolerance):
        """Geometric mean of the errors, and microseconds per simulated second and trajectory."""
        import numpy

        problem = self.problem
        # Of a motor's scene only the free body is marched.
        pick = [1, 3] if problem["motors"] else list(range(2 * len(problem["diagonal"])))
        starts = numpy.array([[start[i] for i in pick] for start in problem["starts"]])
        ends, spent = [], 0.0
        integrator = self.integrator(tolerance, len(pick))
        for first in range(0, len(starts), self.batch):
            if self.batch == 1:
                integrator.time = 0.0
                integrator.state[:] = starts[first]
            else:
                integrator.set_time(0.0)
                integrator.state[:] = starts[first : first + self.batch].T
            clock = time.perf_counter()
            integrator.propagate_until(problem["until"])
            spent += time.perf_counter() - clock
            ends.extend(integrator.state.T.copy() if self.batch > 1 else [integrator.state.copy()])
        logs = 0.0
        for end, exact in zip(ends, problem["ends"]):
            off = [abs(found - exact[i]) for found, i in zip(end, pick)]
            angles = len(pick) // 2
            off = [min(x % math.tau, math.tau - x % math.tau) if k < angles else x for k, x in enumerate(off)]
            logs += math.log(max(max(off), 1e-18))
        return math.exp(logs / len(ends)), spent * 1e6 / (problem["until"] * len(ends))


def setting(code, target):
    """The loosest tolerance that reaches the target."""
    for rung in range(20, 77):
        tolerance = 10.0 ** (-rung / 4)
        error, _ = code.run(tolerance)
        if error <= target:
            return tolerance, error
    return None


def main():
    prepare(__file__)
    driftless = Driftless()
    print(f"{'scene':10} {'target':>6}  {'code':34} {'setting':>8} {'error':>8} {'min us/s':>9} {'median':>9}")
    for scene, target in CASES:
        if sys.argv[1:] and scene not in sys.argv[1:]:
            continue
        problem = driftless.ask("problem", scene)
        codes = [Ours(driftless, "taylor", order) for order in (16, 20, 24)]
        codes += [Ours(driftless, "batch", order) for order in (16, 20, 24)]
        codes += [Heyoka(problem, batch) for batch in (1, 4, 8)]
        settings = [setting(code, target) for code in codes]
        times = [[] for _ in codes]
        for _ in range(BLOCKS):
            for code, found, spent in zip(codes, settings, times):
                if found:
                    spent.append(code.run(found[0])[1])
        for code, found, spent in zip(codes, settings, times):
            if found:
                spent.sort()
                row = f"{found[0]:8.1e} {found[1]:8.1e} {spent[0]:9.2f} {spent[len(spent) // 2]:9.2f}"
            else:
                row = "does not reach it"
            print(f"{scene:10} {target:6.0e}  {code.name:34} {row}", flush=True)


if __name__ == "__main__":
    main()

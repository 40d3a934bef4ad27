#!/usr/bin/env python3
"""Time of many digits beside heyoka's `real` type, in alternating runs.

Run by hand from the root of the repository, after `cargo build --release`: `python3 benches/peers/digits_beside_heyoka.py [DIGITS...]`.
Makes a virtual environment in `target/peers` and installs heyoka from PyPI there.  `free` over 10 s, numbers as written, one row at the end;
heyoka gets the equations written out, the bits that driftless carries, and the tolerance 10^-DIGITS.  Times are seconds of processor: of the whole
program here, of the integration alone there (its code is compiled before).  heyoka 7.13 is wrong by 2.5e-12 at 30 digits, so 33 are the default.

heyoka: F. Biscani, D. Izzo, MNRAS 504 (2021) 2614.
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

from environment import ROOT, prepare

PROGRAM = os.environ.get("DRIFTLESS", os.path.join(ROOT, "target", "release", "driftless"))
RUNS = 5


def ours(digits):
    """Seconds, and the last angles."""
    scene = os.path.join(ROOT, "examples", "scenes", "free.json")
    with tempfile.TemporaryDirectory() as folder:
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        command = [PROGRAM, "run", scene, "--digits", str(digits), "--every", "10", "--json"]
        ran = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    bodies = json.loads(ran.stdout)["final"]["bodies"]
    return seconds, [bodies[name]["phi"] for name in ("bar1", "bar2")]


class Theirs:
    """heyoka on the equations of the double pendulum, divided by m l^2."""

    def __init__(self, digits):
        import heyoka as hy

        self.hy, self.bits = hy, -(-digits * 3322 // 1000) + 28
        number = self.number
        one, two = hy.make_vars("phi1", "phi2")
        v, w = hy.make_vars("omega1", "omega2")
        outer = number("1") / number("4") + number("145") / number("1728")
        inner = outer + number("1")
        half, pull = number("0.5"), number("9.81") / number("0.6")
        mixed, bend = half * hy.cos(one - two), half * hy.sin(one - two)
        first = -bend * w * w - number("1.5") * pull * hy.sin(one)
        second = bend * v * v - half * pull * hy.sin(two)
        determinant = inner * outer - mixed * mixed
        system = [
            (one, v),
            (two, w),
            (v, (outer * first - mixed * second) / determinant),
            (w, (inner * second - mixed * first) / determinant),
        ]
        self.integrator = hy.taylor_adaptive(
            system, self.start(), fp_type=hy.real, prec=self.bits, tol=number(f"1e-{digits}"), compact_mode=True
        )

    def number(self, text):
        return self.hy.real(text, self.bits)

    def start(self):
        up = "1.5707963267948966"
        return [self.number(text) for text in (up, up, "0", "0")]

    def run(self):
        """Seconds, and the last angles."""
        self.integrator.time = self.number("0")
        self.integrator.state[:] = self.start()
        before = time.process_time()
        outcome = self.integrator.propagate_until(self.number("10"))
        seconds = time.process_time() - before
        self.steps = outcome[3]
        return seconds, [str(x) for x in self.integrator.state[:2]]


def main():
    prepare(__file__)
    for digits in [int(word) for word in sys.argv[1:]] or [33, 100]:
        theirs = Theirs(digits)
        pairs = [(ours(digits), theirs.run()) for _ in range(RUNS)]
        ratio = statistics.median(a[0] / b[0] for a, b in pairs)
        a, b = (statistics.median(pair[k][0] for pair in pairs) for k in (0, 1))
        print(f"{digits} digits: driftless {a:.3f} s, heyoka {b:.3f} s (order {theirs.integrator.order}, {theirs.steps} steps), {ratio:.3f}")
        for name, mine, other in zip(("phi1", "phi2"), pairs[-1][0][1], pairs[-1][1][1]):
            print(f"  {name} {mine}\n       {other}")


if __name__ == "__main__":
    main()

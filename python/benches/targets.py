"""Figures of the Python package: import, first run, many runs, rows, callbacks, sweeps by several means.

``python python/benches/targets.py [--dask]``, with the package installed; medians of several, with the least
and the largest.
"""

from __future__ import annotations

import hashlib
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pydriftless as dl

SCENES = Path(__file__).resolve().parents[2] / "examples" / "scenes"


def timed(work, count=7):
    spent = []
    for _ in range(count):
        begin = time.perf_counter()
        work()
        spent.append(time.perf_counter() - begin)
    return spent


def told(name, spent, scale=1.0, unit="s"):
    middle, least, most = (scale * pick(spent) for pick in (statistics.median, min, max))
    print(f"{name:52} {middle:9.4g} {unit}  ({least:.4g} to {most:.4g})", flush=True)


def imports():
    code = "import time, numpy; b = time.perf_counter(); import pydriftless; print(time.perf_counter() - b)"
    words = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True) for _ in range(7)]
    told("import, beyond numpy's own", [float(word.stdout) for word in words], 1e3, "ms")


def runs():
    free = dl.load(SCENES / "free.json")
    told("1000 runs of 1 s", timed(lambda: [free.run(until=1, trust="off") for _ in range(1000)], 3))
    rows = 10_001
    options = {"until": 100, "every": 100 / (rows - 1), "method": "dp8", "trust": "off"}
    plain = timed(lambda: free.run(**options))
    told(f"{rows} rows, 100 s by dp8", plain)
    seen = timed(lambda: free.run(**options, callback=lambda t, row: None))
    told("a callback a row beyond that", [(a - b) / rows for a, b in zip(sorted(seen), sorted(plain))], 1e6, "µs")


def interrupted(method):
    code = (
        "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"import pydriftless as dl\nscene = dl.load({str(SCENES / 'free.json')!r})\nprint('going', flush=True)\n"
        f"import time\ntry:\n    scene.run(until=1e6, method={method!r}, every=10, trust='off', max_evaluations=1e10)\n"
        "except KeyboardInterrupt as stop:\n    print(time.time(), len(stop.checkpoint), flush=True)\n"
    )
    import signal

    spent = []
    for _ in range(5):
        child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
        child.stdout.readline()
        time.sleep(0.7)
        sent = time.time()
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate()
        spent.append(float(out.split()[0]) - sent)
    told(f"from Ctrl-C to its exception, {method}", spent, 1e3, "ms")


def digest(rows):
    return hashlib.sha256(rows.tobytes()).hexdigest()[:16]


def sweeps(with_dask):
    free = dl.load(SCENES / "free.json")
    grid = {"bar1.phi": (-3.0, 3.0, 100), "bar2.phi": (-3.0, 3.0, 100)}
    begin = time.perf_counter()
    whole = free.sweep(grid, until=60)
    print(f"10 000 starts of 60 s, one process: {time.perf_counter() - begin:.2f} s, {digest(whole.rows)}")
    parts = [free.sweep(grid, until=60, shard=(number, 8)) for number in range(1, 9)]
    joined = hashlib.sha256(b"".join(part.rows.tobytes() for part in parts)).hexdigest()[:16]
    print(f"8 parts: {joined}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        free.sweep(grid, until=60, to=Path(folder) / "points.csv", chunk=1000)
    if not with_dask:
        return
    from distributed import Client, LocalCluster

    with LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        free.sweep({"bar1.phi": (0, 1, 8)}, until=1, client=client)
        begin = time.perf_counter()
        found = free.sweep(grid, until=60, client=client)
        print(f"Dask, two workers: {time.perf_counter() - begin:.2f} s, {digest(found.rows)}", flush=True)
        many = {"bar1.phi": (-3.0, 3.0, 400), "bar2.phi": (-3.0, 3.0, 250)}
        for _ in range(2):
            begin = time.perf_counter()
            here = free.sweep(many, until=20, threads=2)
            alone = time.perf_counter() - begin
            begin = time.perf_counter()
            there = free.sweep(many, until=20, client=client, parts=40)
            spent = time.perf_counter() - begin
            same = digest(here.rows) == digest(there.rows)
            print(f"100 000 points of 20 s: {alone:.2f} s on two threads, {spent:.2f} s by Dask; same bytes: {same}")
        import threading

        def kill():
            next(iter(cluster.workers.values())).process.process._process.kill()

        threading.Timer(2.0, kill).start()
        found = free.sweep(grid, until=60, client=client, parts=40)
        print(f"one worker killed after 2 s: {digest(found.rows)}", flush=True)


if __name__ == "__main__":
    imports()
    runs()
    for method in ("taylor", "dp8", "dopri5", "dop853", "radau9"):
        interrupted(method)
    sweeps("--dask" in sys.argv)

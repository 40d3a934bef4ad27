"""What ten outputs add to a dense run: `free` by dp8, in processor time an output and row.

    python3 benches/outputs.py target/release/driftless [SECONDS_A_ROW [PAIRS]]

Runs with and without outputs take turns; the median of their differences is told, with the least and the largest.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OUTPUTS = ["A.force", "B.force", "A.fx", "A.fy", "B.fx", "B.fy", "bar1.alpha", "bar2.alpha", "bar2.ax", "bar2.ay"]
ROWS = 200_000


def spent(program, scene, folder):
    """Processor time of a run [s], of all its threads."""
    options = ["--method", "dp8", "--no-charts", "--trust", "off", "--quiet", "--force", "--out", folder]
    child = subprocess.Popen([program, "run", scene, *options])
    _, status, usage = os.wait4(child.pid, 0)
    if status != 0:
        sys.exit(f"{program} failed")
    return usage.ru_utime + usage.ru_stime


def main():
    program = sys.argv[1]
    every = float(sys.argv[2]) if len(sys.argv) > 2 else 1e-3
    pairs = int(sys.argv[3]) if len(sys.argv) > 3 else 9
    with open(os.path.join(ROOT, "examples", "scenes", "free.json"), encoding="utf-8") as file:
        scene = json.load(file) | {"until": ROWS * every, "every": every}
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, name) for name in ("plain.json", "outputs.json")]
        for path, more in zip(paths, ({}, {"outputs": OUTPUTS})):
            with open(path, "w", encoding="utf-8") as file:
                json.dump(scene | more, file)
        added = []
        for _ in range(pairs):
            plain, full = (spent(program, path, folder) for path in paths)
            added.append((full - plain) / ROWS / len(OUTPUTS) * 1e6)
    print(f"rows of {every:g} s: {statistics.median(added):.3f} µs an output and row ({min(added):.3f} to {max(added):.3f})")


if __name__ == "__main__":
    main()

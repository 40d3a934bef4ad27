import json
from pathlib import Path

import pytest

import pydriftless as dl

SCENES = Path(__file__).resolve().parents[2] / "examples" / "scenes"


@pytest.fixture
def scenes():
    return SCENES


@pytest.fixture
def free():
    return dl.load(SCENES / "free.json")


@pytest.fixture
def program():
    """Runs the program in a process of its own."""
    import subprocess
    import sys

    def run(*arguments, cwd=None):
        words = [sys.executable, "-m", "pydriftless", *map(str, arguments)]
        done = subprocess.run(words, capture_output=True, text=True, cwd=cwd, check=False)
        return done.returncode, done.stdout, done.stderr

    return run


def table(path):
    """A CSV file as names and numbers, read without pydriftless."""
    import csv

    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return rows[0], rows[1:]


def record(path):
    return json.loads(Path(path).read_text())

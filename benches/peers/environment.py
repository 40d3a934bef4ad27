"""The environment that the comparisons beside heyoka run in, and where things are."""

import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PLACE = os.path.join(ROOT, "target", "peers")
PYTHON = os.path.join(PLACE, "bin", "python")


def prepare(script):
    """Goes on with a script inside the virtual environment, which is made and given heyoka where it is missing."""
    if os.path.abspath(sys.prefix) == PLACE:
        return
    if not os.path.exists(PYTHON):
        subprocess.run([sys.executable, "-m", "venv", PLACE], check=True)
        subprocess.run([PYTHON, "-m", "pip", "install", "--quiet", "heyoka", "numpy"], check=True)
    os.execv(PYTHON, [PYTHON, os.path.abspath(script), *sys.argv[1:]])

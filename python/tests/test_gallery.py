"""The gallery of the documentation: its code runs, and its pictures are what the code draws."""

import os
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "gallery.md"
PICTURES = ROOT / "docs" / "pictures"


def words(svg):
    found = re.findall(r'aria-label="(.*?)"', svg)
    assert len(found) > 5, "letters are drawn as paths that say what they are"
    return found


@pytest.mark.skipif(not PAGE.exists(), reason="the documentation is not here")
def test_its_code_draws_its_pictures(tmp_path, monkeypatch):
    page = PAGE.read_text(encoding="utf-8")
    shutil.copytree(ROOT / "examples" / "scenes", tmp_path / "examples" / "scenes")
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "gallery.md", "exec"), names)
    shown = re.findall(r"\(pictures/(gallery_\w+\.svg)\)", page)
    assert len(shown) >= 6 and sorted(shown) == sorted(path.name for path in tmp_path.glob("*.svg"))
    for name in shown:
        drawn = (tmp_path / name).read_text(encoding="utf-8")
        if os.environ.get("UPDATE_DOCS"):
            (PICTURES / name).write_text(drawn, encoding="utf-8")
        assert words(drawn) == words((PICTURES / name).read_text(encoding="utf-8")), f"{name}: set UPDATE_DOCS=1"

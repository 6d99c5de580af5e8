"""The Python on the guide's pages runs, block after block of a page in one program."""

import importlib.util
import re
from pathlib import Path

import pytest

GUIDE = Path(__file__).parents[3] / "docs" / "guide"


@pytest.mark.parametrize(("page", "needs"), [("python.md", "pandas"), ("from-sympy.md", "sympy")])
def test_page(page, needs, tmp_path, monkeypatch, capsys):
    pytest.importorskip(needs)
    monkeypatch.chdir(tmp_path)
    text = (GUIDE / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)
    assert len(blocks) >= 2
    names: dict = {"__name__": page}
    for block in blocks:
        absent = [name for name in re.findall(r"^import (ray|dask)$", block, re.M) if not importable(name)]
        if absent:
            continue
        line = text[: text.index(block)].count("\n")
        exec(compile("\n" * line + block, page, "exec"), names)
    # What the pages say is printed.
    printed = capsys.readouterr().out
    for shown in re.findall(r"  # (.*) is printed$", "\n".join(blocks), re.M):
        assert shown in printed, shown


def importable(name):
    return importlib.util.find_spec(name) is not None

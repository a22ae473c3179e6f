"""The code of the documentation does what it says."""

import doctest
import re
from pathlib import Path

import pytest

import portolan

ROOT = Path(__file__).resolve().parents[3]
BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "PYTHON.md").read_text(), re.S)


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_blocks(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "docs/PYTHON.md", "exec"), {})


def test_the_example_of_the_package():
    assert doctest.testmod(portolan).attempted > 0 and doctest.testmod(portolan).failed == 0


def test_there_are_blocks():
    assert len(BLOCKS) >= 7

"""The examples run as they are, beside a copy of data/, and docs/python.md says what its code prints."""
import contextlib
import io
import os
import pathlib
import re
import shutil

import pytest
from conftest import ROOT

EXAMPLES = sorted(pathlib.Path(ROOT, "examples", "python").glob("*.py"))


@pytest.fixture
def beside_data(tmp_path, monkeypatch):
    shutil.copytree(os.path.join(ROOT, "data"), tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(source, name, names):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(source, name, "exec"), names)
    return out.getvalue()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_example_runs(path, beside_data):
    text = path.read_text()
    assert text.startswith("# %% [markdown]\n# # ") and len(text.splitlines()) < 80
    assert printed(text, str(path), {}).count("\n") > 4


def test_there_are_three_examples():
    assert len(EXAMPLES) == 3


def test_the_code_of_the_page_prints_what_the_page_says(beside_data):
    """A block of code is followed by a block of text where it prints something; `...` stands for anything."""
    page = pathlib.Path(ROOT, "docs", "python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", page, re.S)
    assert len(blocks) > 5
    names = {}
    for code, expected in blocks:
        pattern = re.escape(expected).replace(r"\.\.\.", ".*")
        found = printed(code, "docs/python.md", names)
        assert re.fullmatch(pattern, found, re.S), f"{code}printed\n{found}and the page says\n{expected}"

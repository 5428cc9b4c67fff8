"""The blocks of code of docs/python.md and of the README do what the text beside them says."""

import contextlib
import io
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]\d+)?")

# Of a printed number, and in units of its last digit; other processors may round otherwise.
RELATIVE, LAST = 2e-3, 1.5


def blocks(document):
    """Blocks of Python with what they print, if that is said."""
    text = (ROOT / document).read_text(encoding="utf-8")
    pattern = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.S | re.M)
    return [(found[1], found[2]) for found in pattern.finditer(text)]


def last_digit(number):
    mantissa, _, exponent = number.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def agree(printed, said):
    """Whether words are the same, and numbers nearly."""
    words = [re.sub(r"\s", "", NUMBER.sub("#", text)) for text in (printed, said)]
    numbers = zip(NUMBER.findall(printed), NUMBER.findall(said))
    close = (
        abs(float(a) - float(b)) <= max(RELATIVE * abs(float(b)), LAST * last_digit(b))
        for a, b in numbers
    )
    return words[0] == words[1] and all(close)


def test_numbers_may_differ_a_little_and_words_not():
    assert agree("mean 173.2 lx", "mean  173.1 lx") and agree("[-0.  1.0]", "[0. 1.0]")
    assert not agree("mean 175 lx", "mean 173 lx")
    assert not agree("mean 173 lx", "median 173 lx")


def test_the_guide_does_what_it_says(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    shutil.copytree(ROOT / "docs/models", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    found = blocks("docs/python.md")
    assert len(found) > 5 and sum(said is not None for _, said in found) > 4
    names = {}
    for code, said in found:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, "docs/python.md", "exec"), names)
        assert agree(printed.getvalue(), said or ""), f"printed\n{printed.getvalue()}\nsaid\n{said}"
    assert (tmp_path / "python-lux.png").stat().st_size > 5000


def test_the_guide_and_the_thermal_page_agree():
    printed = "".join(said or "" for _, said in blocks("docs/python.md"))
    table = (ROOT / "docs/thermal.md").read_text(encoding="utf-8")
    for name, kelvin in re.findall(r"^(?:sun |shade)? *([a-z-]+) +(\d+\.\d) K", printed, re.M):
        assert re.search(rf"^\| {name} \| {kelvin} \|", table, re.M), (name, kelvin)


def test_the_readme_works(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "docs/models", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    (code, _), = blocks("README.md")
    exec(compile(code, "README.md", "exec"), {})

"""Compiled code that is kept is of the sources that there are."""

import importlib.util
import shutil
from pathlib import Path

from onboard.core.filter import limits, loops, runs
from onboard.core.maths import compiler


def told_by(file):
    """What a copy of the compiler says of the sources around it."""
    spec = importlib.util.spec_from_file_location("a_copy", file)
    copy = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(copy)
    return copy._sources()


def test_a_constant_of_another_file_is_enough_to_compile_anew(tmp_path):
    """numba itself looks at the file of the function alone: a filter took half of a change."""
    for module in (compiler, limits):
        there = tmp_path / Path(module.__file__).parent.name
        there.mkdir()
        shutil.copy(module.__file__, there)
    copy, constants = tmp_path / "maths" / "compiler.py", tmp_path / "filter" / "limits.py"
    before = told_by(copy)
    assert told_by(copy) == before
    text = constants.read_text()
    constants.write_text(text.replace("GATE_HEIGHT: Final = 30.0", "GATE_HEIGHT: Final = 31.0"))
    assert constants.read_text() != text
    changed = told_by(copy)
    assert changed != before
    (tmp_path / "maths" / "more.py").write_text("x = 1\n")
    assert told_by(copy) != changed


def test_it_is_kept_by_what_the_sources_are():
    for made in (loops.predict, runs.run):
        assert made.py_func.__qualname__.endswith(compiler._sources())

"""A revision against itself: nothing differs, and both are run."""

import shutil
import subprocess

import pytest

from benchmarks import against
from benchmarks.against import HERE, Compared, exported, rows, usual_revision
from benchmarks.apart import apart
from benchmarks.explain_time import Cost, flown

pytestmark = pytest.mark.skipif(
    shutil.which("git") is None or not (HERE / ".git").exists(), reason="taken out of git"
)


def test_a_revision_against_itself_is_the_same(tmp_path):
    """Two copies of HEAD; what is not committed has no part in it."""
    head = exported("HEAD", tmp_path / "head")
    # Of a folder that is new, loops would be compiled for half a minute: numpy does what they do.
    (head / "onboard" / "core" / "maths" / "compiler.py").write_text("raise ImportError\n")
    log = tmp_path / "short.tlog"
    flown(log, "copter", 1, (), 45.0)
    found = against.compared(head, head, "replay", log, 2)
    assert found.answers.nothing
    assert len(found.before) == len(found.now) == 2
    assert all(c.processor > 0.0 and c.memory > 0.0 for c in (*found.before, *found.now))
    assert "the very same answers" in list(rows("replay", found))[1]


def test_the_code_that_runs_is_that_of_the_folder(tmp_path):
    head = exported("HEAD", tmp_path / "head")
    (head / "onboard" / "__main__.py").write_text("raise SystemExit(7)\n")
    with pytest.raises(subprocess.CalledProcessError) as caught:
        against.run(head, "replay", tmp_path / "none.tlog", tmp_path / "out.json")
    assert caught.value.returncode == 7


def test_ratios_are_those_of_pairs():
    """A machine that is three times as slow for a while is so for both of a pair."""
    before = tuple(Cost(x, x, 200.0) for x in (4.0, 12.0, 5.0))
    now = tuple(Cost(0.5 * x, x, 150.0) for x in (4.0, 12.0, 5.0))
    found = Compared(before, now, apart({}, {}))
    assert found.ratio("processor") == 0.5
    assert found.ratio("memory") == 0.75


def test_a_revision_that_is_none_is_said(capsys):
    against.main(["no-such-revision"])
    assert "nothing to compare with" in capsys.readouterr().out


def test_without_a_revision_there_is_one_and_it_says_which():
    try:
        revision, why = usual_revision()
    except against.NoRevisionError:
        pytest.skip("neither a tag nor main: a shallow copy")
    assert revision
    assert why

"""The filter's arithmetic: numpy's and the compiled against textbook matrices and each other."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import onboard.core.filter
from onboard.core.filter import kernel
from onboard.core.filter.innovations import Epoch, steps
from onboard.core.filter.kernel import NUMPY, Process
from onboard.core.filter.readings import reading
from onboard.core.filter.state import ERRORS, HEADING, MEASURED, RATE, STATES
from onboard.core.maths.compiling import prefer_compiled
from onboard.core.maths.frames import rotation_from_vector
from tests.core.compiled import assert_close

compiled = pytest.importorskip("onboard.core.filter.compiled", reason="numba is not installed")
KERNELS = pytest.mark.parametrize("who", [NUMPY, compiled.COMPILED], ids=["numpy", "compiled"])
KINDS = [v + h + a for v in ("", "vv", "vvv") for h in ("", "h") for a in ("", "tty")][1:]


def carried(rng, members, m, *, noise):
    """Means and regressors beside covariances, none of them special."""
    count = 4 if noise else 1
    roots = 0.3 * rng.normal(size=(members, count, STATES, STATES))
    covariances = roots @ np.swapaxes(roots, -1, -2) + 0.1 * np.eye(STATES)
    X = rng.normal(size=(members, STATES, m + 1))
    return np.concatenate([X, *(covariances[:, i] for i in range(count))], axis=2)


def parts(all_, m):
    X, rest = all_[:, :, : m + 1], all_[:, :, m + 1 :]
    return X, np.stack(np.split(rest, rest.shape[2] // STATES, axis=2), axis=1)


def turned(rng):
    return rotation_from_vector(rng.normal(size=3))


def step_of(rng, m):
    shapes = ((3, 3), (2, 3), (3, 3), (9, m + 1))
    integrals = [0.3 * rng.normal(size=(1, *s)) for s in shapes]
    integrals[-1][:, :, 0] = 0.0
    missed, stated = rng.uniform(0.0, 0.1, size=(1, 6)), rng.uniform(0.1, 10.0, size=1)
    shaken = rng.uniform(0.0, 0.1, size=(1, 3))
    return steps(np.array([0.2]), *integrals, missed, shaken, stated)[0]


def process_of(rng, members):
    return Process(
        np.append(rng.normal(size=4), np.zeros(3)),
        rng.uniform(0.5, 1.0, size=(members, MEASURED)),
        rng.uniform(-1.0, 1.0, size=(members, 3)),
        *(rng.uniform(0.0, 0.1, size=(2, members, STATES))),
    )


def measurement(rng, m):
    return rng.normal(size=(MEASURED, m + 1))


def reads(kinds):
    """(r, STATES) the matrix that the filter's reading stands for."""
    number = reading(kinds).number
    H = np.zeros((len(number), STATES))
    H[range(len(number)), number] = 1.0
    H[range(len(number)), number + ERRORS] = 1.0
    return H


banks = st.sampled_from([(1, True), (1, False), (4, False)])
seeds = st.integers(0, 2**32 - 1)


@KERNELS
@given(seeds, banks, st.integers(1, 30))
@settings(max_examples=25)
def test_a_step_is_the_transition_of_every_matrix(who, seed, bank, m):
    rng = np.random.default_rng(seed)
    before = carried(rng, bank[0], m, noise=bank[1])
    R, step, process = turned(rng), step_of(rng, m), process_of(rng, bank[0])
    F = np.tile(np.eye(STATES), (bank[0], 1, 1))
    F[:, :MEASURED, :ERRORS] = kernel.transition(R, step)
    F[:, range(ERRORS, RATE), range(ERRORS, RATE)] = process.decay
    F[:, HEADING, RATE], F[:, RATE, HEADING], F[:, RATE, RATE] = process.swing.T
    X, P = parts(before, m)
    # What a force does to the velocity is along body axes.
    to_ned = np.eye(STATES)
    to_ned[:3, :3] = R
    first, then = (
        np.stack([to_ned @ np.diag(q) @ to_ned.T for q in x])
        for x in (process.before, process.after)
    )
    grown = np.zeros_like(P)
    if bank[1]:
        for axis in range(3):
            walk = process.before[0, axis] + process.after[0, axis]
            grown[0, 1 + axis, :3, :3] = walk * np.outer(R[:, axis], R[:, axis])
    P = P.copy()
    P[:, 0] += first
    P = F[:, None] @ P @ np.swapaxes(F, -1, -2)[:, None] + grown
    P[:, 0] += then
    P[:, 0, :3, :3] += R @ np.diag(step.missed[:3]) @ R.T
    P[:, 0, 4:7, 4:7] += R @ np.diag(step.missed[3:]) @ R.T
    X = F @ X
    X[:, :MEASURED] += kernel.stack_to_ned(R, step.columns)
    X[:, :MEASURED, 0] += process.fall
    after = before.copy()
    who.predict(after, R, step, process)
    for got, expected in zip(parts(after, m), (X, P), strict=True):
        assert_close(got, expected)


@KERNELS
@given(seeds, banks, st.integers(1, 30), st.sampled_from(KINDS))
@settings(max_examples=60)
def test_an_update_is_that_of_the_textbook(who, seed, bank, m, kinds):
    """Joseph's form with the gain ``P H^T S^-1``; whitened innovations have the same NIS."""
    rng = np.random.default_rng(seed)
    before = carried(rng, bank[0], m, noise=bank[1])
    z, noise = measurement(rng, m), rng.uniform(0.05, 1.0, size=(bank[0], MEASURED))
    read, H = reading(kinds), reads(kinds)
    gram = np.zeros(3) if bank[1] else None
    after = before.copy()
    made = who.whiten(after, z, read, noise)
    who.take(after, made, read, gram)

    X, P = parts(before, m)
    N = np.stack([np.diag(n[read.number]) for n in noise])
    S = H @ P[:, 0] @ H.T + N
    E = z[read.number] - H @ X
    K = np.swapaxes(np.linalg.solve(S, H @ P[:, 0]), -1, -2)
    kept = (np.eye(STATES) - K @ H)[:, None]
    expected = kept @ P @ np.swapaxes(kept, -1, -2)
    expected[:, 0] += K @ N @ np.swapaxes(K, -1, -2)
    X_after, P_after = parts(after, m)
    assert_close(X_after, X + K @ E, 1e-9)
    assert_close(P_after, expected, 1e-9)
    assert_close(made.E, E[0])
    W = made.W[:, :, : m + 1]
    assert_close(np.swapaxes(W, -1, -2) @ W, np.swapaxes(E, -1, -2) @ np.linalg.solve(S, E), 1e-9)
    assert_close(made.log_var.sum(axis=1), np.linalg.slogdet(S)[1])
    if gram is not None:
        assert_close(
            gram, [np.trace(np.linalg.solve(S[0], H @ P[0, 1 + i] @ H.T)) for i in range(3)], 1e-9
        )


@given(seeds, st.integers(1, 30))
@settings(max_examples=25)
def test_what_an_epoch_measures_is_the_same_of_both(seed, m):
    rng = np.random.default_rng(seed)
    ned = measurement(rng, m)
    ned[2, 0] = np.nan  # no vertical speed
    body, along = rng.normal(size=(9, m + 1)), rng.normal(size=m)
    epoch = Epoch(0.0, ned[:3, 0], 0.0, 0.0, None, body, ned, along, trusted=True)
    R, turn = turned(rng), rng.normal(size=3)
    one, two = (who.measured(R, epoch, 1.7, turn) for who in (NUMPY, compiled.COMPILED))
    assert np.isnan(one[2, 0])
    np.testing.assert_allclose(two, one, rtol=0.0, atol=1e-13, equal_nan=True)


@KERNELS
def test_a_covariance_that_is_none_is_an_error(who):
    all_ = carried(np.random.default_rng(0), 2, 3, noise=False)
    all_[1, 0, 4] = -100.0
    all_[1, 0, 5:] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        who.whiten(all_, np.zeros((MEASURED, 4)), reading("vvv"), np.zeros((2, MEASURED)))


@pytest.fixture
def _preference_kept():
    yield
    prefer_compiled()


@pytest.mark.usefixtures("_preference_kept")
def test_without_numba_numpy_does_it(monkeypatch):
    monkeypatch.delattr(onboard.core.filter, "compiled")
    monkeypatch.setitem(sys.modules, "onboard.core.filter.compiled", None)
    assert kernel.chosen() is NUMPY


ROOT = Path(onboard.__file__).parents[1]


def python(code, **environment):
    return subprocess.run(  # noqa: S603
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    ).stdout


def test_what_runs_no_filter_does_not_import_the_compiler():
    commands = "onboard.cli.main, onboard.cli.replay, onboard.cli.explain, onboard.cli.run"
    asked = "from onboard.answers.recorded import Recorded; Recorded()"
    assert python(f"import sys, {commands}; {asked}; print('numba' in sys.modules)") == "False\n"


@pytest.mark.usefixtures("_preference_kept")
def test_without_a_place_to_keep_compiled_code_numpy_does_it(monkeypatch):
    """As in an installation that nobody but its owner can write to."""

    def nowhere(*_):
        raise RuntimeError("cannot cache function: no locator available")

    for name in ("compiled", "loops", "motion", "runs", "tail_loops"):
        monkeypatch.delattr(onboard.core.filter, name)
        monkeypatch.delitem(sys.modules, f"onboard.core.filter.{name}")
    monkeypatch.setattr("numba.core.caching.FunctionCache.__init__", nowhere)
    assert kernel.chosen() is NUMPY


@pytest.mark.slow
def test_two_processes_may_fill_the_same_cache(tmp_path):
    code = """
        from onboard.core.maths.compiler import compiled
        @compiled("f8(f8)")
        def doubled(x):
            return 2.0 * x
        assert doubled(3.0) == 6.0
        """
    (tmp_path / "twice.py").write_text(textwrap.dedent(code))
    paths = os.pathsep.join((str(ROOT), str(tmp_path)))
    environment = {**os.environ, "PYTHONPATH": paths}
    for _ in range(2):  # compiled, then found
        made = [
            subprocess.Popen([sys.executable, "-W", "error", "-c", "import twice"], env=environment)
            for _ in range(2)
        ]
        assert [p.wait(timeout=120) for p in made] == [0, 0]
        assert list(tmp_path.rglob("*.nbc"))

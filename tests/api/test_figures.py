"""Figures show what the results hold, and their absence is one clear line."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from onboard.errors import ExtraError, UsageError

pytestmark = pytest.mark.slow


@pytest.fixture
def figures():
    """matplotlib's, or a reason to skip."""
    return pytest.importorskip("matplotlib.figure", reason="matplotlib (the extra plot) is absent")


def curve(ax, label):
    return next(line for line in ax.get_lines() if line.get_label() == label)


def test_the_courses_end_at_the_answer(asked, figures):
    imu = asked.calibration.imu(1)
    axes = asked.calibration.plot(imu=1).axes
    assert len(axes) == 6
    ends = [curve(ax, "estimate").get_ydata()[-1] for ax in axes]
    assert ends == pytest.approx([*imu.scale, *imu.offset], abs=1e-9)
    for ax in axes:
        low, high = ax.get_ylim()
        assert low < curve(ax, "estimate").get_ydata()[-1] < high


def test_the_residuals_are_those_of_the_result(asked, figures):
    found = asked.explanation
    axes = found.plot().axes
    measured = [k for k in range(3) if np.isfinite(found.before[:, k]).any()]
    assert len(axes) == len(measured)
    for ax, k in zip(axes, measured, strict=True):
        assert np.array_equal(curve(ax, "before").get_ydata(), found.before[:, k], equal_nan=True)
        assert np.array_equal(curve(ax, "after").get_ydata(), found.after[:, k], equal_nan=True)


def test_the_force_is_predicted_better_after(asked, figures):
    for ax in asked.match.plot().axes[:2]:
        before, after = (np.nanstd(curve(ax, name).get_ydata()) for name in ("before", "after"))
        assert after < before


def test_a_figure_shows_itself_and_keeps_nothing_open(asked, figures):
    figure = asked.explanation.plot()
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert "matplotlib.pyplot" not in sys.modules
    assert isinstance(figure, figures.Figure)


def test_a_figure_of_ones_own_is_drawn_into(asked, figures):
    own = figures.Figure(figsize=(4, 3))
    assert asked.match.plot(own) is own
    assert own.axes


def test_an_accelerometer_that_is_not_there_is_named(asked):
    with pytest.raises(UsageError, match="no accelerometer 4"):
        asked.calibration.plot(imu=4)


def test_without_matplotlib_it_is_one_line_of_our_own(asked, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for result in (asked.calibration, asked.explanation, asked.match):
        with pytest.raises(ExtraError, match=r"plots need matplotlib: pip install") as caught:
            result.plot()
        assert "\n" not in str(caught.value)

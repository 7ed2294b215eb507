"""GPS is called trusted once the autopilot's filter has had its say, not before."""

import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.samples import EkfHealth, GpsFix, ImuSample
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.limits import FILTER_SILENT_S
from onboard.daemon.learning.store import Store

HEALTHY, UNINITIALISED = 0b11_0011_1111, 1 << 10
STEP = 0.1


@pytest.fixture
def learner(tmp_path):
    return Learner(Store(tmp_path), Calibrator().settings, clock=float, wall_clock=float)


def heard(learner, start, end, flags=None):
    """Samples and fixes from start to end, s, and reports of the filter at 2 Hz if it sends any.

    What was told meanwhile, and whether GPS was ever shown as trusted.
    """
    told, trusted = [], False
    for k in range(round(start / STEP), round(end / STEP)):
        t = k * STEP
        samples = [ImuSample(t, 1, (0.0, 0.0, -9.8))]
        if k % 2 == 0:
            samples.append(GpsFix(t, 1, 3, 0.82, 0.14, 400.0, 0.0, 0.0, satellites=11, hdop=0.9))
        if flags is not None and k % 5 == 4:
            samples.append(EkfHealth(t, flags))
        learned = learner.learn(samples, judging=())
        told += [news.text for news in learned.news if news.kind.startswith("window")]
        trusted |= learned.trust.open
    return told, trusted, learned.trust


def test_a_filter_that_is_not_ready_at_the_start_is_not_preceded_by_trust(learner):
    told, trusted, view = heard(learner, 1.0, 20.0, UNINITIALISED)
    assert (told, trusted) == ([], False)
    assert (view.reason, view.windows) == ("ekf_unhealthy", 0)
    told, trusted, view = heard(learner, 20.0, 40.0, HEALTHY)
    assert told == ["GPS is trusted: ready to learn in flight"]
    assert view.open
    assert view.windows == 1
    told, trusted, view = heard(learner, 40.0, 41.0, UNINITIALISED)
    assert told == ["GPS is not trusted: ekf unhealthy"]


def test_until_the_filter_is_heard_that_is_the_reason(learner):
    told, trusted, view = heard(learner, 1.0, 2.0)
    assert (told, trusted) == ([], False)
    assert view.reasons == ("ekf_unknown",)
    told, _, view = heard(learner, 2.0, 3.0, HEALTHY)
    assert (len(told), view.open) == (1, True)


def test_an_autopilot_whose_filter_says_nothing_is_trusted_after_a_while(learner):
    told, _, _ = heard(learner, 1.0, FILTER_SILENT_S)
    assert told == []
    told, _, view = heard(learner, FILTER_SILENT_S, FILTER_SILENT_S + 2.0)
    assert (len(told), view.open) == (1, True)


def test_after_a_reboot_its_filter_has_said_nothing_yet(learner):
    heard(learner, 1.0, 60.0, HEALTHY)
    told, _, view = heard(learner, 1.0, 2.0)
    assert told == ["GPS is not trusted: restarted"]
    assert view.reasons == ("ekf_unknown",)

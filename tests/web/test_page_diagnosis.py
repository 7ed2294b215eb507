"""The diagnosis on the page: in the words of the service."""

import pytest

from onboard.core.physics.catalogue import kinds
from onboard.push.diagnosed import headline
from tests.web.story import DIAGNOSIS, holding, story


def test_diagnosis_in_words(browser, served):
    browser.open(served.url)
    served.tell(story(20), diagnosis=DIAGNOSIS)
    browser.until_says("#diagnosis-body", "GPS is late")
    words = browser.text("#diagnosis-body")
    assert "GPS1_DELAY_MS = 210" in words
    assert "83 % of the mismatch" in words
    assert "fly banked turns both ways" in words
    assert "0.055 m/s; it was 0.65 m/s" in words


@pytest.mark.slow
def test_plain_latency_is_no_alarm(browser, served):
    effect = DIAGNOSIS["effects"][0] | {"severity": "info"}
    sentence, severity = headline("explained", ["gps_latency"])
    known = DIAGNOSIS | {"headline": sentence, "severity": severity, "effects": [effect]}
    served.tell(story(20), diagnosis=known)
    browser.open(served.url)
    browser.until_says("#diagnosis-body", "Nothing is missing")
    assert DIAGNOSIS["headline"] not in browser.text("#diagnosis-body")
    assert browser.elements("#diagnosis-body .warn") == []
    served.tell(diagnosis=DIAGNOSIS)
    browser.until_says("#diagnosis-body .warn", DIAGNOSIS["headline"])


@pytest.mark.slow
def test_the_diagnosis_says_what_it_holds_back(browser, served):
    served.tell(story(160), diagnosis=DIAGNOSIS)
    browser.open(served.url)
    assert "held back" not in browser.text("#diagnosis-body")
    served.tell(push=holding({"physics_missing": "physics missing: GPS is late"}))
    browser.until_says("#diagnosis-body", "held back for IMU 1, IMU 2")


@pytest.mark.slow
def test_the_page_says_of_every_effect_what_the_catalogue_states(browser, served):
    effects = [DIAGNOSIS["effects"][0] | {"name": kind.effect} for kind in kinds()]
    served.tell(story(160), diagnosis=DIAGNOSIS | {"effects": effects})
    browser.open(served.url)
    browser.until_says("#diagnosis-body", kinds()[-1].title)
    said = browser.text("#diagnosis-body")
    assert [kind.title for kind in kinds() if kind.title not in said] == []

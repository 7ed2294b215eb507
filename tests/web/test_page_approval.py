"""What the page shows of a push before and after it, and what a person can do."""

import msgspec
import pytest

from tests.web.page_server import PageServer
from tests.web.story import holding, story, wrote

ROLL_BACK = """document.querySelector('#confirm').close();
document.querySelector('#push-all [data-action="rollback"]').click(); return true;"""


@pytest.mark.slow
@pytest.mark.parametrize("action", ["approve", "reject"])
def test_what_a_person_says_is_confirmed_first_and_reaches_the_service(browser, served, action):
    served.tell(story(160))
    browser.open(served.url)
    browser.element(f'[data-imu="2"] [data-action="{action}"]').click()
    assert browser.element("#confirm").get_attribute("open") is not None
    assert served.told.asked == []
    browser.element("#confirm-yes").click()
    browser.until_says("#push-result", f"{action.capitalize()} taken")
    assert served.told.asked == [(action, (2,))]


def test_approval_shows_before_and_after_and_cancelling_changes_nothing(browser, served):
    served.tell(story(160))
    browser.open(served.url)
    browser.element('[data-imu="1"] [data-action="approve"]').click()
    row = browser.text("#confirm-changes tbody tr")
    assert "INS_ACCSCAL_X" in row
    assert "1.0000" in row
    assert "1.02" in row
    assert browser.run("return document.activeElement.id") == "confirm-no"
    browser.run("return document.activeElement").send_keys("\ue00c")  # escape
    browser.until(lambda: browser.element("#confirm").get_attribute("open") is None)
    assert served.told.asked == []


def test_it_is_said_once_what_the_sigma_of_a_written_value_is_of(browser, served):
    """A card's has the gyroscope's axes in it: it may be many times as large."""
    served.tell(story(160))
    browser.open(served.url)
    assert browser.text("#proposals").count("accelerometer and gyroscope together") == 1


@pytest.mark.slow
def test_roll_back_and_forgetting(browser, served):
    served.tell(story(30), push=wrote(story(0).push))
    browser.open(served.url)
    for action, imus in (("rollback", (1,)), ("reset", ())):
        browser.element(f'#push-all [data-action="{action}"]').click()
        browser.element("#confirm-yes").click()
        browser.until_says("#push-result", f"{action.capitalize()} taken")
        assert served.told.asked[-1] == (action, imus)


@pytest.mark.slow
def test_a_roll_back_shows_what_is_in_force_and_what_would_be_written(browser, served):
    def shown():
        cells = (browser.text(f"#confirm-changes tbody td:nth-child({n})") for n in (1, 2, 3))
        return list(cells)

    served.tell(story(30), push=wrote(story(0).push))
    browser.open(served.url)
    browser.element('#push-all [data-action="rollback"]').click()
    assert shown() == ["INS_ACCSCAL_X", "1.02400", "1.00100"]
    browser.element("#confirm-no").click()
    served.tell(parameters={"INS_ACCSCAL_X": 1.03})  # somebody has changed it since
    browser.until(lambda: browser.run(ROLL_BACK) and shown()[1] == "1.03000")
    assert served.told.asked == []
    browser.element("#confirm-no").click()
    browser.element('#push-all [data-action="reset"]').click()
    assert browser.elements("#confirm-changes tr") == []


@pytest.mark.slow
def test_what_a_push_has_brought_stays_when_nothing_is_left_to_change(browser, served):
    """In force and estimate are the same then: the residual of before is in what was written."""
    imus = tuple(
        msgspec.structs.replace(view, velocity_rms_before_m_s=0.05) for view in story(160).imus
    )
    served.tell(story(160), imus=imus, push=wrote(story(160).push))
    browser.open(served.url)
    words = browser.text("#written-body")
    for said in ("0.610", "0.0510", "0.0550", "the residual has not grown", "1.00100", "1.02400"):
        assert said in words
    browser.element("#tab-2").click()
    browser.until(lambda: browser.element("#written").get_attribute("hidden") is not None)


@pytest.mark.slow
def test_a_refusal_is_shown_with_its_reason(browser, served):
    served.tell(story(160))
    served.told.refusal = "nothing waits for approval"
    browser.open(served.url)
    browser.element('[data-imu="1"] [data-action="approve"]').click()
    browser.element("#confirm-yes").click()
    browser.until_says("#push-result", "nothing waits for approval")
    browser.expect_complaints("409")


@pytest.mark.slow
def test_a_token_is_asked_for_and_then_works(browser, tmp_path):
    with PageServer(tmp_path, token="key") as served:
        served.tell(story(160))
        browser.open(served.url)
        browser.element('[data-imu="1"] [data-action="approve"]').click()
        browser.element("#confirm-yes").click()
        browser.until_says("#push-result", "token missing or wrong")
        browser.expect_complaints("401")
        assert browser.run("return document.activeElement.id") == "token-field"
        assert served.told.asked == []
        browser.element("#token-field").send_keys("key\n")
        browser.element('[data-imu="1"] [data-action="approve"]').click()
        browser.element("#confirm-yes").click()
        browser.until_says("#push-result", "Approve taken")
        assert served.told.asked == [("approve", (1,))]


def standing(**changes):
    """The accelerometers of the story's end in another state."""
    return tuple(
        msgspec.structs.replace(v, state=msgspec.structs.replace(v.state, **changes))
        for v in story(160).imus
    )


def test_the_state_of_an_accelerometer_is_told_as_the_service_says_it(browser, served):
    """Tile and proposal alike: the page makes no story of its own."""
    told = {"title": "held back", "sentence": "not written: the board is another"}
    served.tell(story(160), imus=standing(**told), push=holding({"other": "the board is another"}))
    browser.open(served.url)
    assert browser.text("#glance-imu-1 .headline") == "Held back"
    assert browser.text("#glance-imu-1 .detail") == "Not written: the board is another."
    assert browser.text('.proposal[data-imu="1"] h3') == "IMU 1: held back"
    for contradiction in ("collecting", "Nothing more needed", "not enough"):
        assert contradiction not in browser.text("main")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("held_back", "approvable", "action", "enabled"),
    [
        ({"unconfirmed": "learned before the last start"}, True, "approve", True),
        ({"unheard_of": "something new"}, True, "approve", True),
        ({"unheard_of": "something new"}, False, "approve", False),
        ({"physics_missing": "the offset jumped"}, True, "override", True),
        ({"not_diagnosed": "none yet", "armed": "armed"}, False, "approve", False),
    ],
)
def test_what_can_be_approved_is_the_services_word(
    browser, served, held_back, approvable, action, enabled
):
    served.tell(story(160), push=holding(held_back, approvable=approvable))
    browser.open(served.url)
    button = browser.element(f'.proposal[data-imu="1"] [data-action="{action}"]')
    assert button.is_enabled() is enabled
    for sentence in held_back.values():
        assert sentence in browser.text('.proposal[data-imu="1"] .held')


@pytest.mark.slow
def test_where_nothing_would_change_there_is_nothing_to_approve(browser, served):
    sentence = "the autopilot has these values already"
    imus = standing(name="up_to_date", title="up to date", sentence=sentence, severity="good")
    served.tell(story(160), imus=imus, push=holding({"nothing_to_change": "no value differs"}))
    browser.open(served.url)
    assert browser.text('.proposal[data-imu="1"] h3') == "IMU 1: up to date"
    assert "The autopilot has these values already." in browser.text('.proposal[data-imu="1"]')
    assert browser.elements('.proposal[data-imu="1"] button') == []

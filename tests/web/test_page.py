"""The status page in a real browser, against the daemon's HTTP server and a told story."""

import re

import msgspec
import pytest

from onboard.core.physics.catalogue import kinds
from onboard.daemon.view.snapshot import WrittenValue, WrittenView
from onboard.push.diagnosed import headline
from tests.web.browsing import LAPTOP, PHONE
from tests.web.page_server import PageServer
from tests.web.story import T0, story

STALE = ("WebSocket", "Failed to load resource")


@pytest.mark.slow
def test_one_glance_says_what_is_trusted_known_missing_and_next(browser, served):
    served.tell(story(40))
    browser.open(served.url)
    assert browser.text("#glance-trust .headline") == "Trusted"
    assert browser.text("#glance-imu-1 .headline") == "Learning"
    assert browser.text("#glance-imu-2 .detail") == "Least of all the z offset."
    assert "Fly banked turns" in browser.text("#glance-next .headline")
    assert "SCALED_IMU2" in browser.text("#link-body")
    assert "slow" in browser.text("#link-body")
    assert "3, 120 ms at most" in browser.text("#link-body")


def test_values_change_as_snapshots_come(browser, served):
    browser.open(served.url)
    before = browser.text('[data-axis="x scale"] .value')
    served.tell(story(160))
    browser.until_says('[data-axis="x scale"] .value', "1.024")
    assert browser.text('[data-axis="x scale"] .value') != before
    assert browser.text("#glance-imu-1 .headline") == "Waits for your approval"
    assert browser.element('[data-axis="z offset"] canvas').size["height"] > 40


@pytest.mark.slow
def test_why_gps_is_not_trusted_is_said_in_words(browser, served):
    browser.open(served.url)
    trust = story(30).trust
    shut = type(trust)(
        phase="suspended",
        open=False,
        reason="jammed",
        reasons=("jammed", "few_satellites"),
        windows=1,
        trusted_s=30.0,
        rejected={},
    )
    served.tell(story(31), trust=shut)
    browser.until_says("#glance-trust .headline", "Not trusted")
    assert "jamming" in browser.text("#glance-trust .detail")
    assert "too few satellites" in browser.text("#glance-trust .detail")


@pytest.mark.slow
def test_each_accelerometer_has_its_tab_reached_by_keyboard(browser, served):
    served.tell(story(160))
    browser.open(served.url)
    assert "INS_ACCSCAL_X" in browser.text('[data-axis="x scale"]')
    browser.element("#tab-1").send_keys("\ue014")  # right arrow
    browser.until_says('[data-axis="x scale"]', "INS_ACC2SCAL_X")
    assert browser.run("return document.activeElement.id") == "tab-2"
    assert browser.element("#tab-2").get_attribute("aria-selected") == "true"


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


@pytest.mark.slow
def test_a_restart_of_the_service_is_said_and_survived(browser, served):
    served.tell(story(20))
    browser.open(served.url)
    served.stop()
    browser.until_says("#connection", "connection lost")
    assert "Connection lost" in browser.text("#banner")
    served.start()
    browser.until(lambda: browser.text("#connection") == "live")
    served.tell(story(160))
    browser.until_says("#glance-imu-1 .headline", "Waits for your approval")
    assert browser.element("#banner").get_attribute("hidden") is not None
    browser.expect_complaints(*STALE)


def wrote(push):
    """Accelerometer 1 was written, and flown since."""
    values = (WrittenValue(name="INS_ACCSCAL_X", before=1.001, written=1.024, read_back=1.024),)
    written = WrittenView(
        imu=1,
        at=T0,
        values=values,
        in_force=True,
        held_out_before=4.2,
        held_out_after=1.1,
        velocity_rms_before_m_s=0.61,
        velocity_rms_after_m_s=0.051,
        verdict="kept",
        verdict_sentence="the residual has not grown",
        next_held_out=1.05,
        next_velocity_rms_m_s=0.055,
    )
    return msgspec.structs.replace(push, can_roll_back=(1,), written=(written,))


def holding(held_back, *, approvable=False):
    push = story(160).push
    proposals = tuple(
        msgspec.structs.replace(p, held_back=held_back, approvable=approvable)
        for p in push.proposals
    )
    return msgspec.structs.replace(push, approval_needed=False, proposals=proposals)


def standing(**changes):
    """The accelerometers of the story's end in another state."""
    return tuple(
        msgspec.structs.replace(v, state=msgspec.structs.replace(v.state, **changes))
        for v in story(160).imus
    )


def test_diagnosis_in_words(browser, served):
    browser.open(served.url)
    served.tell(story(20), diagnosis=DIAGNOSIS)
    browser.until_says("#diagnosis-body", "GPS is late")
    words = browser.text("#diagnosis-body")
    assert "GPS1_DELAY_MS = 210" in words
    assert "83 % of the mismatch" in words
    assert "fly banked turns both ways" in words
    assert "0.055 m/s; it was 0.65 m/s" in words


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


@pytest.mark.slow
def test_plain_latency_is_no_alarm(browser, served):
    effect = DIAGNOSIS["effects"][0] | {"severity": "info"}
    sentence, severity = headline("explained", ["gps_latency"])
    known = DIAGNOSIS | {"headline": sentence, "severity": severity, "effects": [effect]}
    served.tell(story(20), diagnosis=known)
    browser.open(served.url)
    browser.until_says("#diagnosis-body", "Nothing is missing")
    assert "Physics is missing" not in browser.text("#diagnosis-body")
    assert browser.elements("#diagnosis-body .warn") == []
    served.tell(diagnosis=DIAGNOSIS)
    browser.until_says("#diagnosis-body .warn", "Physics is missing")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "labels"),
    [
        ([0, 10, 20], ["0", "10", "20 s"]),
        ([0, 180, 360], ["0", "3", "6 min"]),
        ([0, 30, 60, 90], ["0", "30", "60", "90 s"]),
        ([0, 3600, 7200], ["0", "1", "2 h"]),
    ],
)
def test_the_time_axis_has_its_unit(browser, served, seconds, labels):
    browser.open(served.url)
    shown = browser.driver.execute_async_script(
        """const [seconds, done] = arguments;
        import('/static/charts.js').then(({elapsed}) => done(elapsed(seconds)));""",
        seconds,
    )
    assert shown == labels


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


def test_text_from_outside_is_text(browser, served):
    browser.open(served.url)
    notice = type(story(0).notices[0])
    hostile = "<img src=x onerror=document.title='taken'>"
    served.tell(story(5), notices=(notice(at=0.0, kind="x", text=hostile),))
    browser.until_says("#journal-lines", hostile)
    assert browser.driver.title == "onboard"
    assert browser.elements("#journal-lines img") == []


def test_before_the_autopilot_is_heard_and_without_numbers_nothing_breaks(browser, served):
    link = story(0).link
    silent = type(link)(**{**_fields(link), "system_id": None, "armed": None, "messages": {}})
    served.tell(story(0, imus=0), link=silent)
    browser.open(served.url)
    browser.until_says("#glance-trust .headline", "No autopilot yet")
    unknown = story(1).imus[0]
    nothing = type(unknown.calibration)(
        **{**_fields(unknown.calibration), "scale": (None,) * 3, "scale_sigma": (None,) * 3}
    )
    view = type(unknown)(**{**_fields(unknown), "calibration": nothing, "certificate": None})
    served.tell(story(1), imus=(view,))
    browser.until_says('[data-axis="x scale"] .value', "no estimate yet")


@pytest.mark.slow
def test_a_day_does_not_make_the_page_grow(browser, served):
    browser.open(served.url)
    rows, first, last, every = browser.driver.execute_async_script(
        """const [seconds, done] = arguments;
        import('/static/history.js').then(({History}) => {
          const history = new History();
          let most = 0;
          for (let t = 0; t < seconds; t += 1) {
            history.add([t, t]);
            most = Math.max(most, history.length);
          }
          done([most, history.rows[0][0], history.rows.at(-1)[0], history.every]);
        });""",
        86_400,
    )
    assert rows <= 600
    assert (first, last) == (0, 86_399)
    assert every == pytest.approx(86_400 / rows, rel=1.0)
    served.tell(story(160))
    browser.until_says("#glance-imu-1 .headline", "Waits for your approval")
    before = browser.run("return document.getElementsByTagName('*').length")
    for second in range(161, 201):
        served.tell(story(second))
    browser.until_says("#glance-trust .detail", "3 min 20 s")
    assert browser.run("return document.getElementsByTagName('*').length") == before


@pytest.mark.slow
def test_charts_survive_a_reload_and_a_restart_of_the_service(browser, served):
    for second in range(0, 161, 20):
        served.tell(story(second))
    browser.open(served.url)
    browser.until_says("#axes-span", "2 min 20 s of trusted flight")
    served.stop()
    browser.until_says("#connection", "connection lost")
    served.start()
    browser.until_says("#connection", "live")
    browser.expect_complaints(*STALE)
    browser.open(served.url)
    browser.until_says("#axes-span", "2 min 20 s of trusted flight")
    served.tell(story(180))
    browser.until_says("#axes-span", "2 min 40 s")


@pytest.mark.slow
@pytest.mark.parametrize("size", [PHONE, LAPTOP])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_it_fits_and_can_be_read(browser, served, size, theme):
    served.tell(story(160), diagnosis=DIAGNOSIS)
    browser.size(size)
    browser.theme(theme)
    browser.open(served.url)
    browser.until(lambda: browser.elements("canvas"))
    assert browser.run("return document.documentElement.scrollWidth") <= size[0]
    poor = browser.run(CONTRASTS)
    assert poor["seen"] > 60
    assert poor["below"] == []
    small = browser.run(
        """return [...document.querySelectorAll('button')].filter((e) => e.offsetHeight &&
        (e.offsetHeight < 30 || e.offsetWidth < 30)).map((e) => e.textContent)"""
    )
    assert small == []


@pytest.mark.slow
def test_everything_that_can_be_done_can_be_reached_by_tabulator(browser, served):
    served.tell(story(160))
    browser.open(served.url)
    reached = set()
    for _ in range(30):
        browser.run("return document.activeElement").send_keys("\ue004")
        reached.add(
            browser.run(
                "const e = document.activeElement; return e.dataset.key || e.id || e.tagName"
            )
        )
    assert {"tab-1", "approve-1", "reject-1", "approve-2", "reject-2", "reset-"} <= reached
    assert {"SUMMARY", "journal-lines"} <= reached


@pytest.mark.slow
def test_the_page_is_light_and_asks_nobody_else(browser, served):
    browser.open(served.url)
    entries = browser.run(
        """return [...performance.getEntriesByType('resource'),
        ...performance.getEntriesByType('navigation')].map((e) => [e.name, e.decodedBodySize])"""
    )
    assert all(name.startswith(served.url) for name, _ in entries)
    assert 50_000 < sum(size for _, size in entries) < 300_000
    policy = browser.driver.execute_async_script(
        """const done = arguments[0];
        fetch('/').then((r) => done(r.headers.get('Content-Security-Policy')));"""
    )
    assert "unsafe" not in policy
    assert re.search(r"script-src 'self'", policy)


def _fields(record):
    return {name: getattr(record, name) for name in record.__struct_fields__}


DIAGNOSIS = {
    "schema": "onboard.explain/1",
    "verdict": "partly_explained",
    "headline": "Physics is missing from the model; a part of it was found.",
    "severity": "warning",
    "recording": {"imu": 1},
    "mismatch": {
        "held_out_velocity_rms_before_m_s": 0.65,
        "held_out_velocity_rms_after_m_s": 0.055,
    },
    "effects": [
        {
            "name": "gps_latency",
            "unknowns": {"delay": {"value": 0.21, "sigma": 0.004, "unit": "s"}},
            "share_of_mismatch": 0.83,
            "parameters": {"GPS1_DELAY_MS": 210},
            "cure": "",
        }
    ],
    "ambiguous": [
        {"names": ["cross_axis", "mount_tilt"], "tell_apart": "fly banked turns both ways"}
    ],
    "not_testable": [{"name": "temperature_drift", "why": "no temperature in the recording"}],
}

ROLL_BACK = """document.querySelector('#confirm').close();
document.querySelector('#push-all [data-action="rollback"]').click(); return true;"""

# WCAG 2 contrast of every visible piece of text against the nearest painted ground behind it.
CONTRASTS = """
const channel = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const parsed = (text) => text.match(/[\\d.]+/g).map(Number);
const light = ([r, g, b]) =>
  0.2126 * channel(r / 255) + 0.7152 * channel(g / 255) + 0.0722 * channel(b / 255);
const ground = (e) => {
  for (let at = e; at; at = at.parentElement) {
    const colour = parsed(getComputedStyle(at).backgroundColor);
    if (colour.length === 3 || colour[3] === 1) return colour;
  }
  return [255, 255, 255];
};
const below = [];
let seen = 0;
for (const e of document.querySelectorAll('body *')) {
  const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
  if (!own || !e.getClientRects().length) continue;
  seen += 1;
  const [a, b] = [light(parsed(getComputedStyle(e).color)), light(ground(e))];
  const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  if (ratio < 4.5) below.push([e.className, e.textContent.slice(0, 40), ratio]);
}
return {seen, below};
"""

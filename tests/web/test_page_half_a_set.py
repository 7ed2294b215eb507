"""Half a set in force: the page says which values, and what to do, above everything else."""

import msgspec
import pytest

from onboard.daemon.view.snapshot import StepView, UnfinishedValue, UnfinishedView
from tests.web.story import story

LAND = "land and disarm: the old values are then put back"
HALF = UnfinishedView(
    imu=1,
    half=True,
    values=(
        UnfinishedValue(name="INS_ACCSCAL_X", before=1.0, written=1.02, now=1.02),
        UnfinishedValue(name="INS_ACCOFFS_X", before=0.05, written=0.2, now=0.05),
        UnfinishedValue(name="INS_ACCOFFS_Y", before=0.06, written=0.1, now=None),
    ),
    sentence="half a set is in force: new INS_ACCSCAL_X = 1.02; old INS_ACCOFFS_X = 0.05",
    next=LAND,
)


@pytest.mark.slow
def test_it_is_said_with_its_values_and_gone_when_it_is_over(browser, served):
    push = story(160).push
    half = msgspec.structs.replace(
        push, state="interrupted", unfinished=(HALF,), can_roll_back=(1,)
    )
    step = StepView(imu=1, text=LAND, severity="error")
    served.tell(story(160), push=half, next_step=step)
    browser.open(served.url)
    assert "Land and disarm" in browser.text("#glance-next .headline")
    told = browser.text('.unfinished[data-imu="1"]')
    assert "IMU 1: half a set is in force" in told
    assert "Land and disarm" in told
    rows = [row.text for row in browser.elements('.unfinished[data-imu="1"] tbody tr')]
    assert ["(new)" in rows[0], "(old)" in rows[1], "not known yet" in rows[2]] == [True] * 3
    browser.element('#push-all [data-action="rollback"]').click()
    assert "1.00000" in browser.text("#confirm-changes tbody tr")
    browser.element("#confirm-no").click()
    served.tell(story(160), push=push)
    browser.until(lambda: not browser.elements(".unfinished"))

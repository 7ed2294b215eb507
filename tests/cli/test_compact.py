"""``onboard status --watch``: nothing that is needed is below the edge of the terminal."""

from __future__ import annotations

import io

import msgspec
import pytest
from rich.cells import cell_len
from rich.console import Console

from onboard.cli.compact import compact
from onboard.cli.happened import happened
from onboard.cli.panel import panel
from onboard.daemon.view.snapshot import JournalLine, Notice
from tests.gcs.vehicles_state import accelerometer, seen

LONG = "a sentence that goes on and on, as those of the core may do on a bad day " * 3


def wordy(number):
    view = accelerometer(number)
    state = msgspec.structs.replace(view.state, next=LONG, sentence=LONG, title="held back by it")
    return msgspec.structs.replace(view, state=state)


def lines(imus, height=24, **changes):
    journal = tuple(
        JournalLine(at=float(n), kind="closed", transaction="a", imu=1, text=LONG) for n in range(9)
    )
    snapshot = msgspec.structs.replace(seen(imus=imus), journal=journal, **changes)
    console = Console(file=io.StringIO(), width=80, height=height)
    console.print(compact(snapshot, height))
    return console.file.getvalue().splitlines()


@pytest.mark.parametrize("count", [0, 1, 2, 3])
@pytest.mark.parametrize("mode", ["active", "advise_only"])
def test_everything_fits_80x24(count, mode):
    shown = lines([wordy(n + 1) for n in range(count)], mode=mode, mode_reason=LONG)
    assert len(shown) <= 24
    assert max(map(cell_len, shown)) <= 80
    for number in range(1, count + 1):
        assert any(line.startswith(f"IMU {number}: held back by it") for line in shown)
    assert sum(line.startswith("estimate") for line in shown) == count


def test_of_two_accelerometers_all_is_shown():
    shown = lines([accelerometer(1), accelerometer(2)])
    for row in ("in force", "estimate", "coverage", "sigma"):
        assert sum(line.startswith(row) for line in shown) == 2
    assert any("1.02123" in line and "-0.10000" in line for line in shown)
    assert any("residual 1.00 -> 0.10 m/s" in line for line in shown)
    assert "--full" in shown[-1]


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_what_is_wrong_is_seen_and_pushes_nothing_out(count):
    link = msgspec.structs.replace(seen().link, warnings=(f"no line: {LONG}", LONG, LONG))
    imus = [wordy(n + 1) for n in range(count)]
    shown = lines(imus, link=link, mode="advise_only", mode_reason=LONG)
    assert len(shown) <= 24
    assert any(line.startswith("warning: no line") for line in shown)
    assert sum(line.startswith("estimate") for line in shown) == count
    assert "--full" in shown[-1]
    console = Console(file=io.StringIO(), width=80)
    console.print(panel(msgspec.structs.replace(seen(), link=link)))
    assert "no line" in console.file.getvalue()
    assert max(map(cell_len, console.file.getvalue().splitlines())) <= 80


def test_a_warning_is_among_what_has_happened_in_its_place_whatever_the_clock_was_set_to():
    def entry(at, text, *, earlier=False, imu=None):
        return JournalLine(
            at=at, kind="closed", transaction="a", imu=imu, text=text, earlier=earlier
        )

    snapshot = msgspec.structs.replace(
        seen(),
        journal=(entry(9e9, "of before", earlier=True), entry(120.0, "begins", imu=2)),
        notices=(
            Notice(at=5000.0, kind="learner_failed", text="the estimator has failed", warning=True),
            Notice(at=110.0, kind="window_opened", text="GPS is trusted"),  # the clock was set back
            Notice(at=121.0, kind="push_begins", text="is in the journal"),
        ),
    )
    assert [line.text for line in happened(snapshot)] == [
        "of before",
        "the estimator has failed",
        "GPS is trusted",
        "IMU 2: begins",
    ]
    console = Console(file=io.StringIO(), width=80)
    console.print(panel(snapshot))
    assert "the estimator has failed" in console.file.getvalue()


def test_the_whole_status_fits_eighty_columns_and_what_is_below_a_heading_stays_below_it():
    path = f"/var/lib/{'onboard-' * 12}journal.jsonl: No space left on device"
    journal = (JournalLine(at=0.0, kind="closed", transaction="a", imu=1, text=path),)
    push = msgspec.structs.replace(seen().push, last_outcome=LONG)
    snapshot = msgspec.structs.replace(seen(imus=[wordy(1)]), journal=journal, push=push)
    console = Console(file=io.StringIO(), width=80, height=24)
    console.print(panel(snapshot))
    shown = console.file.getvalue().splitlines()
    assert max(map(cell_len, shown)) <= 80
    assert not any("…" in line for line in shown)
    assert path.replace(" ", "") in "".join("".join(shown).split())
    below = shown[next(i for i, line in enumerate(shown) if line.startswith("IMU 1")) + 1 :]
    assert {line[0] for line in below if line.strip() and not line.startswith("push")} == {" "}

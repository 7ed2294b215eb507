"""The learner in its thread: saved, damaged, hanging, late and reset."""

import errno
import itertools
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from onboard.core.inputs.samples import ImuSample
from onboard.errors import StateError
from tests.daemon.daemons import WANTED, convinced, held_back, until
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


async def test_a_restart_goes_on_from_the_saved_sums(document, daemon, port):
    async with Vehicle(port):
        async with daemon(document) as service:
            await until(lambda: service.handover.learned is not None)
        async with daemon(document) as again:
            await until(lambda: again.snapshot().counters.get("state_resumed") == 1)


async def test_damaged_sums_are_told_and_not_used(document, daemon, port, tmp_path):
    vehicle = Vehicle(port)
    file = tmp_path / "state" / f"sums-board-{vehicle.board}.bin"
    file.parent.mkdir()
    file.write_bytes(b"not sums")
    async with daemon(document) as service, vehicle:
        await until(lambda: service.snapshot().counters.get("state_refused") == 1)
        assert any("set aside" in notice.text for notice in service.snapshot().notices)


async def test_a_learner_that_hangs_starves_the_watchdog_but_not_the_link(
    document, daemon, port, monkeypatch
):
    release = threading.Event()
    monkeypatch.setattr("onboard.daemon.learning.limits.STEP_LIMIT_S", 0.1)
    async with daemon(document) as service, Vehicle(port):
        await until(lambda: service.handover.learned is not None)
        service.handover._learner.learn = lambda *_, **__: release.wait(30.0)
        await until(lambda: not service.handover.keeps_up(service._clock()))
        count = service.snapshot().link.messages["RAW_IMU"].count
        await until(lambda: service.snapshot().link.messages["RAW_IMU"].count > count + 5)
        sent = []
        service._notifier.send = lambda **fields: sent.append(fields)
        await service.on_tick(service._clock())
        assert sent == []
        monkeypatch.setattr("onboard.daemon.process.limits.SAVE_S", 0.1)
    release.set()


async def test_a_learner_that_lags_says_so_and_catches_up(document, daemon, port, monkeypatch):
    release = threading.Event()
    monkeypatch.setattr("onboard.daemon.learning.limits.BEHIND_S", 0.3)
    monkeypatch.setattr("onboard.daemon.learning.limits.CAUGHT_UP_S", 0.29)
    monkeypatch.setattr("onboard.daemon.process.limits.BEHIND_WORTH_SAYING_S", 0.29)

    def said(service, kind):
        return [notice.text for notice in service.snapshot().notices if notice.kind == kind]

    async with daemon(document) as service, Vehicle(port):
        await until(lambda: service.handover._begun)
        learner = service.handover._learner
        learn, learned = learner.learn, []

        def slow(samples, **how):
            release.wait(30.0)
            learned.extend(samples)
            return learn(samples, **how)

        learner.learn = slow
        await until(lambda: said(service, "learner_behind"))
        assert service.snapshot().counters["fell_behind"] == 1
        assert "behind" in service._portrait.sentence(service._clock())
        release.set()
        await until(lambda: said(service, "learner_caught_up"))
        times = [s.t for s in learned if isinstance(s, ImuSample)]
        assert len(times) > 3
        assert max(b - a for a, b in itertools.pairwise(times)) < 0.1, "nothing was left out"


async def test_what_waits_for_a_diagnosis_is_no_lag(document, daemon, port, monkeypatch):
    release = threading.Event()
    monkeypatch.setattr("onboard.daemon.learning.limits.BEHIND_S", 0.3)
    monkeypatch.setattr("onboard.daemon.learning.limits.CAUGHT_UP_S", 0.29)
    async with daemon(document) as service, Vehicle(port):
        handover = service.handover
        await until(lambda: handover._begun)
        learner = handover._learner
        learn = learner.learn

        def landed(samples, **how):
            learner.learn = learn
            return replace(learn(samples, **how), diagnosing=(1,))

        def slow():
            release.wait(30.0)
            return replace(handover.learned, diagnosing=())

        learner.learn, learner.examine = landed, slow
        await until(lambda: handover.learned.diagnosing and handover.behind(service._clock()) > 0.6)
        await service.on_tick(service._clock())
        release.set()
        await until(lambda: not handover.learned.diagnosing)
        handover.tell_of_lag(service._clock())
        assert "fell_behind" not in service.snapshot().counters


async def test_reset_forgets_on_disk_too(document, daemon, port, tmp_path):
    document["estimator"] = {"save_every_s": 0.01}
    async with daemon(document) as service, Vehicle(port) as vehicle:
        file = tmp_path / "state" / f"sums-board-{vehicle.board}.bin"
        await until(file.exists)
        before = service.handover._learner._calibrator
        await service.reset(())
        assert service.handover._learner._calibrator is not before
        assert service.snapshot().counters["resets"] == 1


async def test_what_the_disk_does_not_forget_is_said_and_nothing_else_is_kept(
    document, daemon, port, tmp_path, monkeypatch
):
    document["push"]["approval"] = True
    document["estimator"] = {"save_every_s": 0.01}
    async with daemon(document) as service, Vehicle(port) as vehicle:
        file = tmp_path / "state" / f"sums-board-{vehicle.board}.bin"
        await until(file.exists)
        convinced(service, WANTED)
        await until(lambda: "approval" in held_back(service))
        vehicle.armed = True
        await until(lambda: "armed" in held_back(service))
        await service.approve((1,))

        def read_only(*_, **__):
            raise OSError(errno.EROFS, "Read-only file system")

        with monkeypatch.context() as patch:
            patch.setattr(Path, "unlink", read_only)
            with pytest.raises(StateError, match="there again at the next start"):
                await service.reset(())
        assert service.parts.proposals.standing(1).approved is None


async def test_a_disk_that_takes_nothing_is_told_on_the_page_once_and_when_it_does_again(
    document, daemon, port, monkeypatch
):
    document["estimator"] = {"save_every_s": 0.01}
    async with daemon(document) as service, Vehicle(port):
        await until(lambda: service.snapshot().counters.get("saves"))

        def full(*_, **__):
            raise OSError(errno.ENOSPC, "No space left on device")

        def said(kind):
            return [n for n in service.snapshot().notices if n.kind == kind]

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", full)
            await until(lambda: service.snapshot().counters.get("save_failed", 0) > 5)
        await until(lambda: said("saved_again"))
        (told,) = said("not_saved")
        assert told.warning
        assert "No space left on device" in told.text


async def test_before_the_first_flight_it_says_what_to_do(document, daemon, port):
    async with daemon(document) as service:
        assert service.snapshot().next_step is None, "nobody is there"
        async with Vehicle(port) as vehicle:
            await until(lambda: service.handover.learned is not None)
            assert service.snapshot().next_step.text.startswith("fly")
            vehicle.stop_talking()
            await until(lambda: service.snapshot().link.state == "silent")
            assert "silent" in service.snapshot().next_step.text

"""The state's disk is full, read-only or failing: nothing is written, all else goes on."""

import asyncio
import errno
import os
from contextlib import ExitStack
from pathlib import Path

import pytest

from onboard.errors import RefusedError
from onboard.push.entries import Planned, Refused
from onboard.push.journal import Journal
from tests.daemon.daemons import (
    WANTED,
    convinced,
    held_back,
    in_force,
    notices,
    push_done,
    pushed,
    ticks,
    until,
)
from tests.daemon.disks import failing
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time
ERRORS = [errno.EROFS, errno.ENOSPC, errno.EIO]


def state(document):
    return Path(document["state"]["directory"])


def told(service):
    """What page, terminal, broker and service manager say."""
    snapshot = service.snapshot()
    warnings = "; ".join(snapshot.link.warnings)
    return [warnings, snapshot.mode_reason, service._portrait.sentence(0.0)]


@pytest.mark.parametrize("number", ERRORS)
async def test_a_start_without_a_disk_learns_says_so_and_writes_when_there_is_one(
    document, daemon, port, monkeypatch, number
):
    document["recording"] = {"enabled": True}
    with ExitStack() as disk:
        disk.enter_context(failing(monkeypatch, state(document), number))
        async with daemon(document) as service, Vehicle(port) as vehicle:
            assert notices(service, "recording_stopped")
            convinced(service, WANTED)
            await until(lambda: "no_journal" in held_back(service))
            await until(lambda: service.handover.unsaved)
            await asyncio.sleep(20.0)
            assert vehicle.sets == []
            assert all(os.strerror(number) in text for text in told(service))
            assert service.snapshot().mode == "advise_only"
            assert "kept over a restart" in " ".join(service.snapshot().link.warnings)
            assert service.snapshot().imus[0].state.name == "held_back"
            assert len(notices(service, "advise_only")) <= 2  # at the start, and of the vehicle
            disk.close()
            await until(lambda: pushed(vehicle) and not service.parts.pusher.busy)
            assert service.snapshot().mode == "active"
            assert notices(service, "journal_back")
    with Journal(state(document) / "journal.jsonl") as journal:
        assert journal.last_completed(1) is not None


@pytest.mark.parametrize("number", ERRORS)
async def test_a_disk_that_fails_while_the_service_runs(
    document, daemon, port, monkeypatch, number
):
    document["estimator"] = {"save_every_s": 1.0}
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.snapshot().counters.get("saves"))
        with failing(monkeypatch, state(document), number):
            # Before anything is to be written: what is learned cannot be saved either.
            await until(lambda: service.snapshot().mode == "advise_only")
            convinced(service, WANTED)
            await until(lambda: "no_journal" in held_back(service))
            await asyncio.sleep(40.0)
            assert vehicle.sets == []
            assert len(notices(service, "advise_only")) == 1
        await until(lambda: pushed(vehicle))
        assert not any("disk" in text for text in told(service))
        await until(lambda: not service.parts.pusher.busy)
        with failing(monkeypatch, state(document), number):
            await until(lambda: service.snapshot().mode == "advise_only")
            with pytest.raises(RefusedError, match="disk does not take the journal"):
                await service.rollback((1,))


async def test_a_transaction_on_whose_way_the_disk_fails_leaves_all_old(
    document, daemon, port, monkeypatch
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        with ExitStack() as disk:
            vehicle.when_set[3] = lambda: disk.enter_context(failing(monkeypatch, state(document)))
            convinced(service, WANTED)
            await until(lambda: len(vehicle.sets) >= 3)
            await until(lambda: not service.parts.pusher.busy)
            assert in_force(vehicle) == pytest.approx(before)
            count, taken_up = len(vehicle.sets), len(notices(service, "push_resumed"))
            await asyncio.sleep(40.0)
            assert len(vehicle.sets) == count
            assert len(notices(service, "push_resumed")) == taken_up, "its end waits for the disk"
        await until(lambda: pushed(vehicle) and not service.parts.pusher.busy)
        assert not service.parts.journal.recover()


async def test_what_a_crash_has_left_open_is_undone_though_the_disk_takes_nothing_more(
    document, daemon, port, monkeypatch
):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        async with daemon(document) as service:
            vehicle.mute_after_sets = 3
            convinced(service, WANTED)
            await until(lambda: len(vehicle.sets) >= 3)
            vehicle.stop_talking()
            await until(lambda: not service.parts.pusher.busy)
        vehicle.mute_after_sets = None
        vehicle.talk_again()
        assert in_force(vehicle) != pytest.approx(before)
        with failing(monkeypatch, state(document)):
            async with daemon(document) as again:
                await until(lambda: in_force(vehicle) == pytest.approx(before))
                count = len(vehicle.sets)
                await asyncio.sleep(40.0)
                assert len(vehicle.sets) == count
                assert len(notices(again, "push_resumed")) == 1
        async with daemon(document) as mended:
            await until(lambda: not mended.parts.journal.recover())
            assert in_force(vehicle) == pytest.approx(before)


async def test_a_refusal_that_the_disk_did_not_take_holds_and_is_written_when_it_does(
    document, daemon, port, monkeypatch
):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: "approval" in held_back(service))
        with failing(monkeypatch, state(document)):
            await service.reject((1,))
            await until(lambda: "refused" in held_back(service))
            assert service.parts.journal.trouble
        await until(lambda: not service.parts.journal.trouble)
        assert "refused" in held_back(service)
        assert vehicle.sets == []
    with Journal(state(document) / "journal.jsonl") as journal:
        assert journal.refusals() == {1: "a person rejected it"}
        assert sum(isinstance(entry, Refused) for _, entry in journal.entries) == 1


async def test_what_could_not_be_read_at_the_start_counts_as_soon_as_it_can(
    document, daemon, port, monkeypatch
):
    """What was refused is not written by one who could not read that it was."""
    async with Vehicle(port) as vehicle:
        async with daemon(document) as service:
            await push_done(service, vehicle)
            await service.rollback((1,))
            await until(lambda: not service.parts.pusher.busy)
        count = len(vehicle.sets)
        with ExitStack() as disk:
            disk.enter_context(failing(monkeypatch, state(document), errno.EIO, unreadable=True))
            async with daemon(document) as again:
                assert not again.parts.journal.read
                convinced(again, WANTED)
                await until(lambda: "no_journal" in held_back(again))
                disk.close()
                await until(lambda: again.parts.journal.read)
                await ticks(again, 10)
                assert "refused" in held_back(again)
                assert any(isinstance(e, Planned) for _, e in again.parts.journal.entries)
        assert len(vehicle.sets) == count

"""The daemon's life over real UDP, against a vehicle that stands still."""

import asyncio
import os
import signal
import socket

import pytest

from onboard.daemon.view.snapshot import Snapshot
from onboard.errors import (
    HeldError,
    LinkError,
    OnboardError,
    UnavailableError,
)
from tests.daemon.daemons import made, until
from tests.daemon.standing_vehicle import Vehicle

pytestmark = pytest.mark.virtual_time


async def test_no_heartbeat_in_the_time_limit_is_a_link_error(document, port):
    document["link"]["heartbeat_limit_s"] = 0.2
    with pytest.raises(LinkError, match=f"no heartbeat.*{port}") as caught:
        await made(document).run()
    assert caught.value.exit_status == 3


async def test_a_taken_udp_port_is_one_line_and_worth_another_try(document, port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
        with pytest.raises(OnboardError, match=f"{port}: port in use") as caught:
            await made(document).run()
    assert caught.value.exit_status == 3


async def test_a_taken_http_port_is_one_line_and_leaves_nothing_behind(document, port):
    with socket.create_server(("127.0.0.1", 0)) as other:
        document["http"]["port"] = other.getsockname()[1]
        with pytest.raises(UnavailableError, match=r"\[http\].*in use") as caught:
            await made(document).run()
    assert caught.value.exit_status == 3
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", port))


async def test_two_daemons_do_not_share_a_state_directory(document, daemon):
    async with daemon(document):
        with pytest.raises(HeldError, match="in use") as caught:
            made(document)
    assert caught.value.exit_status == 3


async def test_it_reads_the_parameters_and_shows_who_is_there(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.snapshot().parameters.keys() >= vehicle.parameters.keys())
        snapshot = service.snapshot()
        assert snapshot.phase == "running"
        assert (snapshot.link.autopilot, snapshot.link.system_id) == ("ardupilot", 1)
        await until(lambda: service.snapshot().link.armed is False)
        assert snapshot.link.messages["RAW_IMU"].count > 0
        assert Snapshot.from_json(snapshot.to_json()) == snapshot


async def test_what_a_ground_station_changes_is_seen(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: "INS_ACC3_ID" in service.snapshot().parameters)
        await until(lambda: service.parts.parameters.complete)
        vehicle.set_by_other("INS_ACCOFFS_X", 0.5)
        await until(lambda: service.snapshot().parameters["INS_ACCOFFS_X"] == 0.5)
        assert service.snapshot().counters["parameters_changed"] == 1


async def test_a_reboot_is_noticed_and_the_parameters_are_read_anew(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: "INS_ACC3_ID" in service.snapshot().parameters)
        vehicle.parameters["INS_ACCOFFS_X"] = 0.75
        vehicle.reboot()
        await until(lambda: service.snapshot().link.counters["reboots"] == 1)
        await until(lambda: service.snapshot().parameters["INS_ACCOFFS_X"] == 0.75)
        assert service.snapshot().counters["autopilot_rebooted"] == 1


async def test_silence_is_told_and_does_not_end_the_service(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.snapshot().link.state == "present")
        vehicle.stop_talking()
        await until(lambda: service.snapshot().link.state == "silent")
        assert service.snapshot().link.armed is None
        async with Vehicle(port):
            await until(lambda: service.snapshot().link.state == "present")


async def test_the_service_manager_hears_ready_ticks_and_stopping(
    document, port, tmp_path, monkeypatch
):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", manager.getsockname())
        service = made(document)
        task = asyncio.create_task(service.run())
        heard = []

        def listen():
            try:
                heard.append(manager.recv(4096).decode())
            except BlockingIOError:
                return

        await until(lambda: listen() or sum("WATCHDOG=1" in line for line in heard) >= 2)
        service.stop()
        await task
        await until(lambda: listen() or "STOPPING" in heard[-1])
        assert heard[0].startswith("READY=1")
        assert not any("WATCHDOG" in line for line in heard[-1:])


async def test_a_tick_that_fails_feeds_no_watchdog_and_ends_the_service(document, port):
    service = made(document)

    def broken(_now):
        raise ArithmeticError("tick")

    service.parts.observed.condition = broken
    with pytest.raises(BaseExceptionGroup) as caught:
        await service.run()
    assert caught.group_contains(ArithmeticError)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
async def test_signals_end_it_in_good_order(document, port, number):
    service = made(document)
    task = asyncio.create_task(service.run(handle_signals=True))
    await until(lambda: service.phase == "searching")
    os.kill(os.getpid(), number)
    await task
    assert service.stopped_by == number
    assert service.phase == "stopped"

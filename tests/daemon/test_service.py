"""The daemon's life over real UDP, against a vehicle that stands still."""

import asyncio
import dataclasses
import itertools
import os
import signal
import socket
import threading

import aiohttp
import pytest

from onboard.core.estimate.result import Status
from onboard.core.inputs.samples import ImuSample
from onboard.core.maths.accelerometer import parameter_names
from onboard.daemon.view.snapshot import Snapshot
from onboard.errors import ConfigurationError, LinkError, OnboardError, RefusedError, StateError
from tests.daemon.daemons import calibration, convinced, made, until
from tests.daemon.standing_vehicle import PX4, Vehicle

pytestmark = pytest.mark.virtual_time
SIX = parameter_names(1).six
WANTED = calibration()


def in_force(vehicle):
    return tuple(vehicle.parameters[name] for name in SIX)


def pushed(vehicle):
    return in_force(vehicle) == pytest.approx(WANTED.scale + WANTED.offset, rel=1e-6)


async def test_no_heartbeat_in_the_time_limit_is_a_link_error(document, port):
    document["link"]["heartbeat_limit_s"] = 0.2
    with pytest.raises(LinkError, match=f"no heartbeat.*{port}") as caught:
        await made(document).run()
    assert caught.value.exit_status == 3


async def test_a_taken_udp_port_is_one_line_and_exit_2(document, port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
        with pytest.raises(OnboardError, match=f"{port}: port in use") as caught:
            await made(document).run()
    assert caught.value.exit_status == 2


async def test_a_taken_http_port_is_one_line_and_leaves_nothing_behind(document, port):
    with socket.create_server(("127.0.0.1", 0)) as other:
        document["http"]["port"] = other.getsockname()[1]
        with pytest.raises(ConfigurationError, match=r"\[http\].*in use"):
            await made(document).run()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", port))


async def test_two_daemons_do_not_share_a_state_directory(document, daemon):
    async with daemon(document):
        with pytest.raises(StateError, match="in use"):
            made(document)


async def test_it_reads_the_parameters_and_shows_who_is_there(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: service.snapshot().parameters.keys() >= vehicle.parameters.keys())
        snapshot = service.snapshot()
        assert snapshot.phase == "running"
        assert (snapshot.link.autopilot, snapshot.link.system_id) == ("ardupilot", 1)
        await until(lambda: service.snapshot().link.armed is False)
        assert snapshot.link.messages["RAW_IMU"].count > 0
        assert Snapshot.from_json(snapshot.to_json()) == snapshot


async def test_a_confident_answer_is_pushed_when_landed_and_read_back(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed, vehicle.landed = True, False
        convinced(service, WANTED)
        await until(lambda: "armed" in held_back(service))
        assert vehicle.sets == []
        vehicle.armed, vehicle.landed = False, True
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert "push completed" in service.snapshot().push.last_outcome
        assert pushed(vehicle)
        assert service.snapshot().push.can_roll_back == (1,)
        assert {name for name, _ in vehicle.sets} == set(SIX)


def held_back(service):
    proposals = service.snapshot().push.proposals
    return proposals[0].held_back if proposals else {}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"status": Status.COLLECTING}, "not_calibrated"),
        ({"parameters_known": False}, "parameters_unknown"),
        ({"scale": (1.3, 1.0, 1.0)}, "out_of_bounds"),
        ({"predictive_gain": 1.0}, "no_improvement"),
    ],
)
async def test_what_is_not_good_enough_is_shown_but_never_written(
    document, daemon, port, change, reason
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, calibration(**change))
        await until(lambda: reason in held_back(service))
        await until(lambda: vehicle.heard.count("PARAM_REQUEST_READ") > 20)
        assert vehicle.sets == []


async def test_missing_physics_is_said_written_down_and_not_written(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        why = "the antenna is 0.6 m away and that is not told"
        convinced(service, WANTED, missing=why, effects=("gps_lever_arm",))
        await until(lambda: why in held_back(service).get("physics_missing", ""))
        snapshot = service.snapshot()
        assert snapshot.diagnosis["effects"][0]["name"] == "gps_lever_arm"
        assert [why in line.text for line in snapshot.journal if line.kind == "found"] == [True]
        await until(lambda: vehicle.heard.count("STATUSTEXT") > 0)
        told = [n.text for n in service.snapshot().notices if n.kind == "physics_missing"]
        assert told == ["physics missing: gps lever arm"]
        assert vehicle.sets == []


async def test_in_spite_of_a_diagnosis_a_person_approves_explicitly_or_not_at_all(
    document, daemon, port
):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, missing="the antenna is elsewhere", effects=("gps_lever_arm",))
        await until(lambda: "physics_missing" in held_back(service))
        for imus in ((), (1,)):
            with pytest.raises(RefusedError, match="--despite-diagnosis"):
                await service.approve(imus)
        with pytest.raises(RefusedError, match="by their number"):
            await service.approve((), despite_diagnosis=True)
        assert not service.snapshot().push.approval_needed
        assert vehicle.sets == []
        await service.approve((1,), despite_diagnosis=True)
        await until(lambda: pushed(vehicle))


async def test_an_approval_in_spite_of_one_diagnosis_is_none_in_spite_of_the_next(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        convinced(service, WANTED, missing="the antenna is elsewhere")
        await until(lambda: {"armed", "physics_missing"} <= held_back(service).keys())
        await service.approve((1,), despite_diagnosis=True)
        await until(lambda: held_back(service).keys() == {"armed"})
        convinced(service, WANTED, missing="the axes are not square")
        await until(lambda: "physics_missing" in held_back(service))
        assert vehicle.sets == []


async def test_what_nobody_has_diagnosed_is_not_written(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        await until(lambda: service.handover.identified)
        convinced(service, WANTED)
        service.handover._learner._flight = None
        await until(lambda: "not_diagnosed" in held_back(service))
        vehicle.armed = False
        await until(lambda: held_back(service).keys() == {"not_diagnosed"})
        assert vehicle.sets == []


async def test_policy_never_only_advises(document, daemon, port):
    document["push"]["policy"] = "never"
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: "policy_never" in held_back(service))
        assert vehicle.sets == []


async def test_an_autopilot_that_is_not_ardupilot_is_advised_and_never_written(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port, firmware=PX4) as vehicle:
        convinced(service, WANTED)
        await until(lambda: service.snapshot().mode == "advise_only")
        await until(lambda: vehicle.heard.count("HEARTBEAT") >= 2)
        snapshot = service.snapshot()
        assert "px4, not ArduPilot" in snapshot.mode_reason
        assert any(notice.kind == "advise_only" for notice in snapshot.notices)
        assert "PARAM_SET" not in vehicle.heard


async def test_approval_is_waited_for_and_asked_for_over_http(document, daemon, port):
    document["push"]["approval"] = True
    async with (
        daemon(document) as service,
        Vehicle(port) as vehicle,
        aiohttp.ClientSession(service.server.url) as client,
    ):
        async with client.post("/api/approve", json={}) as response:
            assert response.status == 409
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.approval_needed)
        assert vehicle.sets == []
        async with client.post("/api/approve", json={"imus": [1]}) as response:
            assert response.status == 200
        await until(lambda: pushed(vehicle))


async def test_an_approval_lapses_when_the_estimate_moves(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        vehicle.armed = True
        convinced(service, WANTED)
        await until(lambda: {"armed", "approval"} <= held_back(service).keys())
        await service.approve(())
        await until(lambda: "approval" not in held_back(service))
        convinced(service, dataclasses.replace(WANTED, offset=(0.3, -0.1, 0.15)))
        await until(lambda: "approval" in held_back(service))
        assert vehicle.sets == []


async def test_a_rejected_push_stays_rejected_until_approved(document, daemon, port):
    document["push"]["approval"] = True
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.approval_needed)
        await service.reject((1,))
        await until(lambda: "refused" in held_back(service))
        assert vehicle.sets == []
        await service.approve((1,))
        await until(lambda: pushed(vehicle))


async def test_a_person_can_roll_back_and_it_is_not_pushed_again(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        with pytest.raises(RefusedError, match="no push"):
            await service.rollback(())
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        assert pushed(vehicle)
        await until(lambda: service.snapshot().link.armed is False)
        await service.rollback(())
        await until(lambda: "roll-back completed" in service.snapshot().push.last_outcome)
        assert in_force(vehicle) == before
        await until(lambda: "refused" in held_back(service))
        assert service.snapshot().push.can_roll_back == ()


async def test_only_the_chosen_accelerometers_are_written(document, daemon, port):
    document["push"]["imus"] = [2]
    async with daemon(document) as service, Vehicle(port) as vehicle:
        convinced(service, WANTED, calibration(2))
        await until(lambda: service.snapshot().push.can_roll_back == (2,))
        assert {name for name, _ in vehicle.sets} == set(parameter_names(2).six)


async def test_what_a_ground_station_changes_is_seen(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: "INS_ACC3_ID" in service.snapshot().parameters)
        await until(lambda: service.parts.parameters.complete)
        vehicle.set_by_other("INS_ACCOFFS_X", 0.5)
        await until(lambda: service.snapshot().parameters["INS_ACCOFFS_X"] == 0.5)
        assert service.snapshot().counters["parameters_changed"] == 1


async def test_a_ground_station_that_writes_in_the_middle_aborts_the_push(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = vehicle.parameters["INS_ACCOFFS_Y"]
        convinced(service, WANTED)
        await until(lambda: len(vehicle.sets) >= 6)
        vehicle.set_by_other("INS_ACCOFFS_Y", 1.25)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert "rolled back" in service.snapshot().push.last_outcome
        assert vehicle.parameters["INS_ACCOFFS_Y"] == 1.25 != before
        assert vehicle.parameters["INS_ACCOFFS_X"] == pytest.approx(0.05)
        assert vehicle.parameters["INS_ACCSCAL_X"] == 1.0


async def test_a_denied_write_leaves_everything_as_it_was_and_is_not_hammered(
    document, daemon, port
):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        vehicle.denied.add("INS_ACCSCAL_Z")
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.last_outcome is not None)
        assert in_force(vehicle) == before
        await until(lambda: "failed_before" in held_back(service))
        assert service.snapshot().counters["pushes"] == 1


async def test_a_reboot_is_noticed_and_the_parameters_are_read_anew(document, daemon, port):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        await until(lambda: "INS_ACC3_ID" in service.snapshot().parameters)
        vehicle.parameters["INS_ACCOFFS_X"] = 0.75
        vehicle.reboot()
        await until(lambda: service.snapshot().link.counters["reboots"] == 1)
        await until(lambda: service.snapshot().parameters["INS_ACCOFFS_X"] == 0.75)
        assert service.snapshot().counters["autopilot_rebooted"] == 1


async def test_a_crash_in_the_middle_of_a_push_is_put_right_after_the_restart(
    document, daemon, port
):
    async with Vehicle(port) as vehicle:
        before = in_force(vehicle)
        vehicle.mute_after_sets = 3
        service = made(document)
        task = asyncio.create_task(service.run())
        convinced(service, WANTED)
        await until(lambda: len(vehicle.sets) == 3)
        task.cancel()  # no stages: as if killed
        await asyncio.gather(task, return_exceptions=True)
        assert in_force(vehicle) != before
        assert not pushed(vehicle)
        vehicle.mute_after_sets = None
        async with daemon(document) as again:
            await until(lambda: again.snapshot().push.last_outcome is not None)
            assert again.snapshot().counters["resumed"] == 1
            assert in_force(vehicle) == before
            journal = again.snapshot().journal
            kinds = [line.kind for line in journal if line.kind != "found"]
            assert kinds[0] == "planned"
            assert kinds[-1] == "closed"


async def test_a_flight_that_was_worse_takes_the_push_back(document, daemon, port, monkeypatch):
    async with daemon(document) as service, Vehicle(port) as vehicle:
        before = in_force(vehicle)
        convinced(service, WANTED)
        await until(lambda: service.snapshot().push.can_roll_back == (1,))
        flown = calibration(
            scale=(1.0, 1.0, 1.0),
            offset=(0.05, 0.06, 0.07),
            in_force_scale=tuple(in_force(vehicle)[:3]),
            in_force_offset=tuple(in_force(vehicle)[3:]),
            held_out_before=9.0,
        )
        monkeypatch.setattr("onboard.daemon.learning.proof.answers", lambda _: {1: flown})
        vehicle.armed, vehicle.landed = True, False
        await until(lambda: service.snapshot().link.armed)
        vehicle.armed, vehicle.landed = False, True
        await until(lambda: service.snapshot().push.can_roll_back == ())
        assert in_force(vehicle) == before
        kinds = [notice.kind for notice in service.snapshot().notices]
        assert "push_worse" in kinds
        judged = service.snapshot().push.judged[0]
        assert (judged.verdict, judged.held_out_before_push) == ("worse", 4.0)
        assert judged.held_out_after_push == 9.0
        await until(lambda: "refused" in held_back(service))


async def test_a_restart_goes_on_from_the_saved_sums(document, daemon, port):
    async with Vehicle(port):
        async with daemon(document) as service:
            await until(lambda: service.handover.learned is not None)
        async with daemon(document) as again:
            await until(lambda: again.snapshot().counters.get("state_resumed") == 1)


async def test_damaged_sums_are_told_and_not_used(document, daemon, port, tmp_path):
    vehicle = Vehicle(port)
    file = tmp_path / "state" / f"sums-1-{vehicle.board}.bin"
    file.parent.mkdir()
    file.write_bytes(b"not sums")
    async with daemon(document) as service, vehicle:
        await until(lambda: service.snapshot().counters.get("state_refused") == 1)
        assert any("set aside" in notice.text for notice in service.snapshot().notices)


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


async def test_reset_forgets_on_disk_too(document, daemon, port, tmp_path):
    document["estimator"] = {"save_every_s": 0.01}
    async with daemon(document) as service, Vehicle(port) as vehicle:
        file = tmp_path / "state" / f"sums-1-{vehicle.board}.bin"
        await until(file.exists)
        before = service.handover._learner._calibrator
        await service.reset(())
        assert service.handover._learner._calibrator is not before
        assert service.snapshot().counters["resets"] == 1


async def test_before_the_first_flight_it_says_what_to_do(document, daemon, port):
    async with daemon(document) as service:
        assert service.snapshot().next_step is None, "nobody is there"
        async with Vehicle(port):
            await until(lambda: service.handover.learned is not None)
            assert service.snapshot().next_step.text.startswith("fly")

"""MAVProxy's module speaks to the component's real parameter server, and shows what it answers."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from onboard.daemon.outlets.parameter_view import STATES, STATUSES, parameter_values
from tests.mqtt.published import imu_view, snapshot

FILE = Path(__file__).resolve().parents[2] / "deploy/share/onboard/mavproxy_obc.py"


class FakeModule:
    """What MAVProxy's base class gives to a module."""

    def __init__(self, mpstate, name, description):
        self.name, self.commands = name, {}
        self.master, self.target_system = mpstate.master, 1

    def add_command(self, name, callback, description, completions):
        self.commands[name] = callback


class Sent:
    """Messages to the vehicle, as they were asked for."""

    def __init__(self):
        self.read, self.written = [], []
        self.mav = self

    def param_request_read_send(self, system, component, name, index):
        assert index == -1
        self.read.append((system, component, name.decode()))

    def param_set_send(self, system, component, name, value, kind):
        self.written.append((system, component, name.decode(), value, kind))


@pytest.fixture
def module(monkeypatch):
    base = ModuleType("mp_module")
    base.MPModule = FakeModule
    lib = ModuleType("MAVProxy.modules.lib")
    lib.mp_module = base
    for name, there in (
        ("MAVProxy", ModuleType("MAVProxy")),
        ("MAVProxy.modules", ModuleType("MAVProxy.modules")),
        ("MAVProxy.modules.lib", lib),
        ("MAVProxy.modules.lib.mp_module", base),
    ):
        monkeypatch.setitem(sys.modules, name, there)
    spec = importlib.util.spec_from_file_location("mavproxy_obc", FILE)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def value(name, number, system=1, component=191):
    return SimpleNamespace(
        get_type=lambda: "PARAM_VALUE",
        get_srcComponent=lambda: component,
        get_srcSystem=lambda: system,
        param_id=name,
        param_value=number,
    )


def test_numbers_of_states_are_those_of_the_service(module):
    assert len(module.STATES) == len(STATES)
    words = [word.replace(" ", "_") for word in module.IMU_STATES[1:]]
    assert {word: number for number, word in enumerate(words, start=1)} == dict(STATUSES)


def test_status_asks_the_component_and_shows_its_answers_once(module, capsys):
    sent = Sent()
    obc = module.init(SimpleNamespace(master=sent))
    obc.commands["obc"](["status"])
    values = parameter_values(snapshot(imus=[imu_view(2)]), imus=3)
    assert {name for _, _, name in sent.read} <= values.keys()
    assert {(system, component) for system, component, _ in sent.read} == {(1, 191)}
    for _ in range(2):
        for name, number in values.items():
            obc.mavlink_packet(value(name, number))
    said = capsys.readouterr().out
    assert said.count("\n") == len(sent.read)
    for line in ("GPS is trusted", "accelerometer 2: up to date", "accelerometer 1: not heard of"):
        assert said.count(line) == 1


def test_others_in_its_name_are_not_heard(module, capsys):
    obc = module.init(SimpleNamespace(master=Sent()))
    obc.commands["obc"](["status"])
    obc.mavlink_packet(value("OBC_STATE", 3.0, component=1))
    obc.mavlink_packet(value("OBC_STATE", 3.0, system=7))
    obc.mavlink_packet(SimpleNamespace(get_type=lambda: "HEARTBEAT"))
    assert capsys.readouterr().out == ""
    obc.mavlink_packet(value("OBC_STATE", 77.0))
    assert "state 77" in capsys.readouterr().out


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -1.0, -1e30, 1e30])
def test_whatever_number_it_is_told_is_shown(module, capsys, number):
    obc = module.init(SimpleNamespace(master=Sent()))
    obc.commands["obc"](["status"])
    asked = [name for _, _, name in obc.master.read]
    for name in asked:
        obc.mavlink_packet(value(name, number))
    assert capsys.readouterr().out.count("obc: ") == len(asked)


def test_approve_sets_one_parameter_and_nothing_else_does(module, capsys):
    sent = Sent()
    obc = module.init(SimpleNamespace(master=sent))
    for words in ([], ["approve", "1"], ["aprove"], ["status"]):
        obc.commands["obc"](words)
    assert sent.written == []
    assert capsys.readouterr().out.count("usage") == 3
    obc.commands["obc"](["approve"])
    assert sent.written == [(1, 191, "OBC_APPROVE", 1.0, 9)]

"""The image's instructions hold: what they copy exists, what they start are commands of ours."""

import importlib.util
import json
import re
import sys
from pathlib import Path

import click
import pytest

import onboard
from onboard.cli import main
from onboard.web.page import BLUEOS

ROOT = Path(__file__).resolve().parents[2]


def loaded(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "deploy" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses ask for it
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def tried():
    yield loaded("try_container")
    del sys.modules["try_container"]


@pytest.fixture(scope="module")
def stages(tried):
    return tried.stages(tried.CONTAINERFILE.read_text(encoding="utf-8"))


def parsed(words):
    """A command of the image, as the program understands it."""
    program, verb, *given = words
    assert program == "/opt/onboard/bin/onboard"
    command = main.cli.get_command(click.Context(main.cli), verb)
    with click.Context(command, info_name=verb) as context:
        command.parse_args(context, given)
        return context.params


def test_what_is_copied_is_all_that_the_wheel_is_made_of(stages):
    copied = {
        word.removeprefix("/")
        for kind, text in stages[0].steps
        if kind == "COPY"
        for word in text.split()[:-1]
    }
    assert all((ROOT / name).exists() for name in copied)
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    sources = set(re.findall(r'^"([\w/]+)" = "', settings, re.MULTILINE))
    assert {"sitl", "deploy/share"} <= sources
    for needed in {*sources, "onboard", "pyproject.toml", "README.md", "LICENSE"}:
        assert needed.split("/")[0] in copied, needed


def test_it_starts_the_service_with_the_file_that_its_health_check_reads(tried, stages):
    service = parsed(tried.started(stages[-1]))
    health = parsed(tried.health(stages[-1]))
    assert service["config"] == health["config"] == "/etc/onboard/onboard.toml"
    assert any(
        "service show configuration > " + service["config"] in t for _, t in stages[-1].steps
    )


def test_it_is_nobody_of_importance_and_keeps_its_state_in_a_volume(tried, stages):
    assert stages[-1].last("USER") == "onboard"
    assert tried.environment(stages[-1])["STATE_DIRECTORY"] == stages[-1].last("VOLUME")


def test_the_labels_of_the_extension_are_those_of_the_program(stages):
    labels = dict(
        re.match(r"(\w+)=[\"'](.*)[\"']$", text).groups()
        for word, text in stages[-1].steps
        if word == "LABEL"
    )
    assert labels["version"] == BLUEOS["version"] == onboard.__version__
    permissions = json.loads(labels["permissions"])
    binds = permissions["HostConfig"]["Binds"]
    assert permissions["NetworkMode"] == "host"
    assert [bind.split(":")[1] for bind in binds] == [stages[-1].last("VOLUME")]
    assert json.loads(labels["tags"])


def test_the_commands_of_the_manuals_are_those_that_are_tried_in_a_clean_root():
    tried = loaded("try_install")
    environment = " ".join(f"{name}={value}" for name, value in tried.PIPX.items())
    for manual in ("README.md", "systemd/README.md", "docs/raspberry-pi.md"):
        text = (ROOT / manual).read_text(encoding="utf-8")
        assert f"sudo {environment} pipx install ." in text, manual
        asked = re.findall(r"^sudo onboard (service install .*--start)", text, re.MULTILINE)
        assert asked, manual
        for words in asked:
            group = main.cli.get_command(click.Context(main.cli), "service")
            verb, *given = words.split()[1:]
            command = group.get_command(click.Context(group), verb)
            with click.Context(command, info_name=verb) as context:
                command.parse_args(context, given)
                assert context.params["start"]
                assert context.params["endpoints"]


def test_what_is_taken_out_is_not_what_is_imported(tmp_path):
    """A folder as pip makes it, with a dialect too many; the proof is a process of its own."""
    slim = loaded("slim")
    dialects = tmp_path / "pymavlink" / "dialects"
    for name in ("v20/ardupilotmega.py", "v20/common.py", "v10/common.py", "v20/__init__.py"):
        (dialects / name).parent.mkdir(parents=True, exist_ok=True)
        (dialects / name).write_text("x = 1\n")
    (tmp_path / "lxml").mkdir()
    (tmp_path / "rich").mkdir()
    slim.PROOF = "\n"
    slim.slim(tmp_path)
    left = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert left == {"pymavlink/dialects/v20/ardupilotmega.py", "pymavlink/dialects/v20/__init__.py"}
    assert not (tmp_path / "lxml").exists()
    assert (tmp_path / "rich").exists()


def test_a_slim_program_that_lacks_something_is_refused(tmp_path):
    slim = loaded("slim")
    (tmp_path / "pymavlink" / "dialects").mkdir(parents=True)
    slim.PROOF = "\nimport surely_not_there\n"
    with pytest.raises(Exception, match="returned non-zero"):
        slim.slim(tmp_path)

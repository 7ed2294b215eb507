"""Manual, man page and completions say what the commands say of themselves now."""

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from onboard.cli.main import VERBS

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def told():
    spec = importlib.util.spec_from_file_location("commands", ROOT / "deploy" / "commands.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["commands"] = module  # dataclasses ask for it
    spec.loader.exec_module(module)
    yield module
    del sys.modules["commands"]


def test_the_files_are_made_of_the_commands_as_they_are(told):
    for path, text in told.made().items():
        assert (ROOT / path).read_text(encoding="utf-8") == text, f"{path}: `make commands`"


def test_every_verb_is_in_the_manual_and_in_the_man_page(told):
    for text in (told.manual(), told.man_page()):
        for verb in VERBS:
            assert re.search(rf"^(## |\.SS )onboard {verb}\b", text, re.MULTILINE), verb


def test_the_man_page_is_one_that_formatters_read_without_complaint(told):
    groff = shutil.which("groff")
    if groff is None:
        pytest.skip("no groff on PATH")
    page = ROOT / told.MAN
    done = subprocess.run(  # noqa: S603 - a page of ours
        [groff, "-man", "-Tutf8", "-ww", str(page)], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    assert "--endpoint" in re.sub(r"\x1b\[[0-9;]*m", "", done.stdout)


def test_bash_completes_verbs_by_the_script(told, tmp_path):
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("no bash on PATH")
    program = tmp_path / "onboard"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m onboard "$@"\n')
    program.chmod(0o755)
    script = f"""
        source '{ROOT / told.COMPLETIONS["bash"]}'
        COMP_WORDS=(onboard ex) COMP_CWORD=1
        _onboard_completion onboard
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(  # noqa: S603 - a script of ours
        [bash, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
    )
    assert done.stdout.split() == ["explain"]

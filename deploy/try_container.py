"""Executes ``deploy/Containerfile`` without an engine: ``try_container.py BASE WORK``.

BASE is the root file system of the image that it begins from, e.g. made by ``mmdebstrap
--variant=apt bookworm BASE``; WORK becomes the image.  Each instruction is carried out in a copy,
by chroot; then the image is started as an engine would, as its user, and its health is checked
until it is healthy.  Needs root.  Nothing outside WORK is written.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CONTAINERFILE = ROOT / "deploy" / "Containerfile"
HEALTHY_WITHIN_S = 60.0
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


@dataclass(slots=True)
class Stage:
    """One FROM and what follows it."""

    name: str
    steps: list[tuple[str, str]] = field(default_factory=list)

    def last(self, instruction: str) -> str:
        """The argument of the last of these instructions."""
        return next(text for word, text in reversed(self.steps) if word == instruction)


def stages(text: str) -> list[Stage]:
    """The instructions of a Containerfile, a line each, by stage."""
    found: list[Stage] = []
    for line in text.splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        word, _, argument = line.partition(" ")
        if word == "FROM":
            found.append(Stage(argument.partition(" AS ")[2] or "image"))
        else:
            found[-1].steps.append((word, argument))
    return found


def environment(stage: Stage) -> dict[str, str]:
    """What ENV sets."""
    pairs = (pair for word, text in stage.steps if word == "ENV" for pair in shlex.split(text))
    return dict(pair.split("=", 1) for pair in pairs)


def health(stage: Stage) -> list[str]:
    """The command of HEALTHCHECK."""
    return _command(stage.last("HEALTHCHECK").partition("CMD ")[2])


def started(stage: Stage) -> list[str]:
    """The command that an engine starts."""
    return _command(stage.last("ENTRYPOINT")) + _command(stage.last("CMD"))


def _command(text: str) -> list[str]:
    words: list[str] = json.loads(text)
    return words


def build(base: Path, work: Path) -> tuple[Stage, Path]:
    """Carry out all stages; the last one and its root."""
    roots: dict[str, Path] = {}
    for stage in stages(CONTAINERFILE.read_text(encoding="utf-8")):
        root = roots[stage.name] = work / stage.name
        subprocess.run(["cp", "-a", str(base), str(root)], check=True)  # noqa: S603, S607
        for word, text in stage.steps:
            begun = time.monotonic()
            if word == "COPY":
                _copy(text, root, roots)
            elif word == "RUN":
                _run(root, ["/bin/sh", "-c", text], environment(stage), check=True)
            else:
                continue
            sys.stdout.write(f"{time.monotonic() - begun:6.1f} s  {word} {text[:90]}\n")
            sys.stdout.flush()
    return stage, root


def _copy(text: str, root: Path, roots: dict[str, Path]) -> None:
    words = shlex.split(text)
    stage = re.fullmatch(r"--from=(\w+)", words[0])
    origin = roots[stage[1]] if stage else ROOT
    *sources, target = words[1:] if stage else words
    there = root / target.lstrip("/")
    for source in sources:
        path = origin / source.lstrip("/")
        if path.is_dir():
            shutil.copytree(path, there, symlinks=True, dirs_exist_ok=True)
        else:
            there.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, there)


def _run(
    root: Path, command: list[str], env: dict[str, str], user: str = "root", *, check: bool = False
) -> subprocess.CompletedProcess[bytes]:
    words = ["chroot", f"--userspec={user}", str(root), *command]
    quiet = subprocess.DEVNULL
    return subprocess.run(words, env={"PATH": PATH, **env}, check=check, stdout=quiet)  # noqa: S603


def becomes_healthy(stage: Stage, root: Path) -> float:
    """Start it, and check its health until it is; s that this took."""
    env, user = environment(stage), stage.last("USER")
    words = ["chroot", f"--userspec={user}:dialout", str(root), *started(stage)]
    begun = time.monotonic()
    service = subprocess.Popen(words, env={"PATH": PATH, **env})  # noqa: S603
    try:
        while time.monotonic() - begun < HEALTHY_WITHIN_S:
            if _run(root, health(stage), env, f"{user}:dialout").returncode == 0:
                return time.monotonic() - begun
            if service.poll() is not None:
                raise SystemExit(f"the service ended with status {service.returncode}")
            time.sleep(0.2)
        raise SystemExit(f"not healthy within {HEALTHY_WITHIN_S} s")
    finally:
        service.terminate()
        service.wait()


def main() -> None:
    """Build, start, measure."""
    base, work = Path(sys.argv[1]), Path(sys.argv[2])
    if os.geteuid() != 0:
        raise SystemExit("chroot needs root")
    work.mkdir(parents=True)
    stage, root = build(base, work)
    took = becomes_healthy(stage, root)
    size, ours = (sum(f.lstat().st_size for f in top.rglob("*") if f.is_file()) / 1e6
                  for top in (root, root / "opt/onboard"))  # fmt: skip
    sys.stdout.write(
        f"healthy {took:.1f} s after the start; {size:.0f} MB, onboard {ours:.0f} MB\n"
    )


if __name__ == "__main__":
    main()

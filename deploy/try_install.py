"""Walks the two ways in, as a user would, in a clean root: ``try_install.py BASE WORK [pipx|deb]``.

BASE is the root file system of a bare system, e.g. made by ``mmdebstrap --variant=minbase bookworm
BASE``; WORK gets a copy.  There onboard is installed from this checkout, by pipx or as a Debian
package that is built there too; a recording is calibrated; the service is installed, started as
its unit starts it, and shown a simulated vehicle.  Each step is timed.  systemd does not run
there, so ``--start`` is left out: ``try_boot.py`` has it.  Needs root and the package registries;
nothing outside WORK is written.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, write_tlog

ROOT = Path(__file__).resolve().parents[1]
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
SEEN_WITHIN_S = 60.0
FLIGHT_S = 260.0
ADDED = Path("/usr/local/share/ca-certificates")
PIPX = {"PIPX_HOME": "/opt/pipx", "PIPX_BIN_DIR": "/usr/local/bin"}
APT = ("apt-get", "install", "--yes", "--quiet", "--no-install-recommends")
INSTALLED = {"pipx": "opt/pipx", "deb": "usr/lib/onboard"}
"""Where the program is, below the root."""


class CleanRoot:
    """A bare system in a folder, in which commands are run."""

    def __init__(self, base: Path, place: Path) -> None:
        self.place = place
        subprocess.run(["cp", "-a", str(base), str(place)], check=True)  # noqa: S603, S607
        self.env = {"PATH": PATH, "HOME": "/root", "DEBIAN_FRONTEND": "noninteractive"}
        self.env["PIP_CERT"] = "/etc/ssl/certs/ca-certificates.crt"
        for name in ("/etc/resolv.conf", "/etc/hosts"):
            shutil.copy(name, place / "etc")
        # Certificates that were added to this machine, where its network has some of its own.
        if ADDED.is_dir():
            shutil.copytree(ADDED, place / str(ADDED).lstrip("/"), dirs_exist_ok=True)

    def words(self, command: list[str], user: str) -> list[str]:
        """What starts a command in it."""
        return ["chroot", f"--userspec={user}", str(self.place), *command]

    def run(self, *command: str, cwd: str = "/root", **env: str) -> str:
        """Its output; a failure is the end."""
        script = ["/bin/sh", "-c", f'cd {cwd} && exec "$@"', "sh", *command]
        return subprocess.run(  # noqa: S603
            self.words(script, "root"),
            env={**self.env, **env},
            check=True,
            stdout=subprocess.PIPE,
            text=True,
        ).stdout

    def start(
        self, *command: str, user: str = "nobody:dialout", **env: str
    ) -> subprocess.Popen[bytes]:
        """A process that goes on; by default as somebody without rights."""
        return subprocess.Popen(  # noqa: S603
            self.words(list(command), user),
            env={**self.env, "HOME": "/", **env},
            stdout=subprocess.DEVNULL,
        )

    def megabytes(self, below: str = "") -> float:
        """What the files in it take, MB."""
        files = (self.place / below).rglob("*")
        return sum(f.lstat().st_size for f in files if f.is_file()) / 1e6


def step(name: str, root: CleanRoot, doing: Callable[[], object]) -> None:
    """Do it, and print how long it took and how large the root is then."""
    begun = time.monotonic()
    doing()
    took = time.monotonic() - begun
    sys.stdout.write(f"{took:6.1f} s  {root.megabytes():5.0f} MB  {name}\n")
    sys.stdout.flush()


def prepare(root: CleanRoot) -> None:
    """The checkout and a recording of a flight whose answer is known."""
    listed = subprocess.run(  # noqa: S603
        ["git", "-C", str(ROOT), "ls-files", "-z"],  # noqa: S607
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    for name in listed.split("\0"):
        if name and not name.startswith("tests/"):
            there = root.place / "source" / name
            there.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, there)
    truth = ImuTruth(scale=(1.021, 0.986, 1.013), offset=(0.21, -0.15, 0.3))
    spec = FlightSpec(vehicle="plane", duration=FLIGHT_S, imus=(truth,), seed=3)
    write_tlog(spec, root.place / "root" / "flight.tlog")


def install(root: CleanRoot, way: str, work: Path, base: Path) -> None:
    """By pipx, for the whole machine; or as a package that was built in a root of its own."""
    step("apt-get update", root, lambda: root.run("apt-get", "update", "--quiet"))
    if way == "pipx":
        step("apt-get install pipx", root, lambda: root.run(*APT, "ca-certificates", "pipx"))
        step("pipx install .", root, lambda: root.run("pipx", "install", "/source", **PIPX))
        return
    builder = CleanRoot(base, work / "builder")
    shutil.copytree(root.place / "source", builder.place / "source")
    builder.run("apt-get", "update", "--quiet")
    builder.run(*APT, "ca-certificates", "python3-venv")
    step(
        "deploy/debian.sh (elsewhere)",
        builder,
        lambda: builder.run("/source/deploy/debian.sh", "/"),
    )
    (package,) = builder.place.glob("*.deb")
    shutil.copy(package, root.place)
    sys.stdout.write(f"{package.name}: {package.stat().st_size / 1e6:.0f} MB\n")
    step("apt-get install ./*.deb", root, lambda: root.run(*APT, f"/{package.name}"))


def calibrate(root: CleanRoot) -> None:
    """The first calibration of a recording, with page and parameter file."""
    said = root.run(
        *("onboard", "replay", "flight.tlog", "--report", "flight.html", "--param", "new.param")
    )
    if "Accelerometer 1: calibrated" not in said:
        raise SystemExit(said)


def serve(root: CleanRoot, way: str) -> None:
    """From the configuration to a service that sees a vehicle."""
    if way == "pipx":
        endpoint = "udpin:127.0.0.1:14550"
        root.run("onboard", "service", "install", "--endpoint", endpoint)
    unit = next(p for p in ("etc/systemd/system", "lib/systemd/system")
                if (root.place / p / "onboard.service").exists())  # fmt: skip
    text = (root.place / unit / "onboard.service").read_text(encoding="utf-8")
    command = re.findall(r"^ExecStart=(.*)$", text, re.MULTILINE)[0].split()
    state = root.place / "var/lib/onboard"
    state.mkdir(parents=True, exist_ok=True)
    shutil.chown(state, "nobody")
    with ExitStack() as stack:
        for process in (
            root.start(*command, STATE_DIRECTORY="/var/lib/onboard"),
            root.start("onboard", "sim", "--out", "127.0.0.1:14550"),
        ):
            stack.callback(process.wait)
            stack.callback(process.terminate)
        wait_for_vehicle(root)


def wait_for_vehicle(root: CleanRoot) -> None:
    """Until the service says that it sees one."""
    end = time.monotonic() + SEEN_WITHIN_S
    while time.monotonic() < end:
        try:
            if json.loads(root.run("onboard", "status", "--json"))["link"]["state"] == "present":
                return
        except subprocess.CalledProcessError:
            pass  # it does not answer yet
        time.sleep(0.2)
    raise SystemExit(f"no vehicle within {SEEN_WITHIN_S} s")


def slim(root: CleanRoot) -> None:
    """What docs/container.md offers to those who want less on the disk."""
    site = next((root.place / INSTALLED["pipx"]).glob("venvs/*/lib/*/site-packages"))
    inside = f"/{site.relative_to(root.place)}"
    python = str(Path(inside).parents[2] / "bin" / "python")
    root.run(python, "/source/deploy/slim.py", inside)
    root.run(python, "-m", "compileall", "-q", inside)
    serve(root, "deb")  # it still does, and needs no installation


def packages(folder: Path) -> list[tuple[float, str]]:
    """What each package takes, MB, the largest first."""
    sizes = {
        entry.name: sum(f.stat().st_size for f in entry.rglob("*") if f.is_file()) / 1e6
        for entry in folder.iterdir()
        if entry.is_dir() and not entry.name.endswith(".dist-info")
    }
    return sorted(((size, name) for name, size in sizes.items()), reverse=True)


def main() -> None:
    """Install, calibrate, serve; how long each took, and what it takes."""
    base, work = Path(sys.argv[1]), Path(sys.argv[2])
    way = sys.argv[3] if len(sys.argv) > 3 else "pipx"
    if os.geteuid() != 0:
        raise SystemExit("chroot needs root")
    work.mkdir(parents=True)
    root = CleanRoot(base, work / "root")
    prepare(root)
    install(root, way, work, base)
    step("onboard replay flight.tlog --report --param", root, lambda: calibrate(root))
    step("onboard service install, started, a vehicle seen", root, lambda: serve(root, way))
    top = root.place / INSTALLED[way]
    sys.stdout.write(
        f"{top.relative_to(root.place)}: {root.megabytes(INSTALLED[way]):.0f} MB, of it\n"
    )
    site = next(top.glob("venvs/*/lib/*/site-packages"), top)
    for size, name in packages(site)[:12]:
        sys.stdout.write(f"  {size:6.1f} MB  {name}\n")
    if way == "pipx":
        step("deploy/slim.py, compiled anew, started again", root, lambda: slim(root))
        sys.stdout.write(f"{INSTALLED[way]}: {root.megabytes(INSTALLED[way]):.0f} MB\n")


if __name__ == "__main__":
    main()

"""The process of a SITL binary: where it is, its ports, its life and its end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import shutil
import socket
import tempfile
from collections.abc import Mapping
from pathlib import Path

from sitl.ardupilot.defaults import defaults_text
from sitl.errors import NoBinaryError, SitlError

DIRECTORY = "ARDUPILOT_SITL_DIR"
HOME = "47.3977,8.5456,488,0"
FRAMES = {"plane": "plane", "copter": "+"}
FIRST_PORT = 5760
PORTS_OF_ONE = (0, 2, 3)
"""Serial ports 0, 1 and 2 listen on these offsets from 5760 + 10 per instance."""
TAKEN = "Address already in use"
"""What a binary says of a port that somebody else listens on."""
AIRFRAME = "airframe.json"
INSTANCES = range(20, 90)
PATIENCE = 30.0
"""Seconds for a binary to open its first port."""


def find_binary(vehicle: str, folder: str | Path | None = None) -> Path:
    """The binary in a folder; without one, in ARDUPILOT_SITL_DIR or on PATH.

    Raises:
        NoBinaryError: in neither.
    """
    name = f"ardu{vehicle}"
    if folder is not None:
        binary = Path(folder) / name
        if os.access(binary, os.X_OK):
            return binary.resolve()
        raise NoBinaryError(f"no {name} binary in {folder}")
    folder = os.environ.get(DIRECTORY)
    if folder:
        binary = Path(folder) / name
        if os.access(binary, os.X_OK):
            return binary.resolve()
    found = shutil.which(name)
    if found:
        return Path(found).resolve()
    where = f"{DIRECTORY} ({folder})" if folder else f"{DIRECTORY} (not set)"
    raise NoBinaryError(f"no {name} binary in {where} or on PATH")


class ArdupilotProcess:
    """One running binary, with an empty parameter store of its own.

    Args:
        vehicle: ``plane`` or ``copter``.
        speedup: simulated seconds a second, as far as the machine can follow.
        parameters: beside the defaults that make it fly.
        airframe: keys of a frame or coefficient file; its own without.
        folder: of the binary; where :func:`find_binary` looks without.
        home: latitude and longitude, deg, altitude, m, heading, deg.
    """

    def __init__(
        self,
        vehicle: str,
        *,
        speedup: float = 5.0,
        parameters: Mapping[str, float] | None = None,
        airframe: Mapping[str, object] | None = None,
        folder: str | Path | None = None,
        home: str = HOME,
    ) -> None:
        self._parameters = parameters or {}
        self._airframe = airframe
        self.vehicle = vehicle
        self._binary = find_binary(vehicle, folder)
        self._home = home
        self._speedup = speedup
        self._folder = tempfile.TemporaryDirectory(prefix="onboard-sitl-")
        self._process: asyncio.subprocess.Process | None = None
        self._instance = 0

    @property
    def ports(self) -> tuple[int, int, int]:
        """TCP ports of the serial ports 0, 1 and 2; each takes one client."""
        first = FIRST_PORT + 10 * self._instance
        return first, first + 2, first + 3

    async def start(self) -> None:
        """Starts it and waits until it listens.

        Raises:
            SitlError: it ended or stayed silent; carries the last of its output.
        """
        folder = Path(self._folder.name)
        defaults = folder / "defaults.parm"
        defaults.write_text(defaults_text(self.vehicle, self._parameters))
        model = FRAMES[self.vehicle]
        if self._airframe is not None:
            (folder / AIRFRAME).write_text(json.dumps(dict(self._airframe)))
            model = f"{model}:{AIRFRAME}"  # read relative to where it is started
        while not await self._listens(folder, model, defaults):
            pass  # another one was quicker to take the ports: others are free

    async def _listens(self, folder: Path, model: str, defaults: Path) -> bool:
        """Start it on ports that are free; False if somebody else took them at the same moment."""
        self._instance = _free_instance()
        with (folder / "output.txt").open("wb") as output:
            self._process = await asyncio.create_subprocess_exec(
                *(str(self._binary), "-w", "--model", model),
                *("--speedup", f"{self._speedup:g}", "--defaults", str(defaults)),
                *("--home", self._home, "-I", str(self._instance)),
                cwd=folder,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=output,
                stderr=output,
            )
        deadline = asyncio.get_running_loop().time() + PATIENCE
        # It opens serial 0 first and waits for a client there: the line says so.
        while "SERIAL0 on TCP port" not in self.output():
            if self._process.returncode is not None:
                if TAKEN in self.output():
                    return False
                raise SitlError(f"{self._binary.name} ended at once: {self.output()[-300:]}")
            if asyncio.get_running_loop().time() > deadline:
                raise SitlError(f"{self._binary.name} does not listen: {self.output()[-300:]}")
            await asyncio.sleep(0.1)
        return True

    def output(self) -> str:
        """What it has printed."""
        return (Path(self._folder.name) / "output.txt").read_text(errors="replace")

    def keep_log(self, out: str | Path) -> None:
        """Copies the last DataFlash log; after it has disarmed, which ends it.

        Raises:
            SitlError: there is none.
        """
        logs = sorted((Path(self._folder.name) / "logs").glob("*.BIN"))
        if not logs:
            raise SitlError("it has written no log")
        shutil.copyfile(logs[-1], out)

    async def stop(self) -> None:
        """Ends it and removes its files."""
        if self._process is not None and self._process.returncode is None:
            self._process.terminate()
            try:
                await asyncio.wait_for(self._process.wait(), 5.0)
            except TimeoutError:
                self._process.kill()
                await self._process.wait()
        self._folder.cleanup()


def _free_instance() -> int:
    """A number whose ports nobody has.

    Raises:
        SitlError: all are taken.
    """
    for instance in INSTANCES:
        with contextlib.ExitStack() as stack:
            try:
                for offset in PORTS_OF_ONE:
                    probe = stack.enter_context(socket.socket())
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                    probe.bind(("127.0.0.1", FIRST_PORT + 10 * instance + offset))
            except OSError:
                continue
        return instance
    raise SitlError("no free TCP ports for another SITL")

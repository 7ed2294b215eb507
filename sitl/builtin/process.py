"""The built-in autopilot in a process of its own, as a real one is: only a port connects them."""

from __future__ import annotations

import asyncio
import contextlib
import re
import sys
from collections.abc import AsyncIterator, Sequence

from sitl.builtin.truth import ImuTruth
from sitl.builtin.world import Vehicle
from sitl.errors import SitlError

PATIENCE = 30.0
LISTENING = re.compile(r"udp:[^:]+:(\d+)")


@contextlib.asynccontextmanager
async def autopilot_process(
    vehicle: Vehicle, imus: Sequence[ImuTruth], *, speedup: float, seed: int, longest: float
) -> AsyncIterator[int]:
    """Runs ``onboard sim`` for as long as the context lasts; gives its UDP port.

    It stands on the ground and flies on command, ``longest`` seconds at most.

    Raises:
        SitlError: it does not start.
    """
    truths = [
        argument
        for imu in imus
        for argument in ("--truth", ",".join(f"{x:.9g}" for x in imu.scale + imu.offset))
    ]
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "onboard", "sim", "--vehicle", vehicle, "--port", "0"),
        *("--flights", "0", "--speedup", f"{speedup:g}", "--seed", str(seed), *truths),
        *("--duration", f"{longest:g}"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    if process.stdout is None:
        raise SitlError("the simulated autopilot has no output")
    try:
        yield await _port(process.stdout)
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()


async def _port(output: asyncio.StreamReader) -> int:
    said = ""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(PATIENCE):
            while line := (await output.readline()).decode(errors="replace"):
                said += line
                if found := LISTENING.search(line):
                    return int(found[1])
    raise SitlError(f"the simulated autopilot does not start: {said.strip()[-300:]}")

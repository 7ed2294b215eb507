"""``onboard sim``: the built-in autopilot alone, for any ground station or for the service."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence

import click

from onboard.errors import UsageError
from sitl.builtin.autopilot import FLIGHT_DURATION, Autopilot
from sitl.builtin.mission import Mission
from sitl.builtin.server import Server
from sitl.builtin.truth import ImuTruth, Truth, random_imus
from sitl.builtin.world import Vehicle

SIX = 6


EXAMPLES = """\
\b
onboard sim                                        # on tcp:127.0.0.1:5760
onboard sim --vehicle plane --out 127.0.0.1:14550  # to a service
onboard sim --truth 1.02,0.99,1.01,0.2,-0.1,0.3 --speedup 5
"""


@click.command(epilog=EXAMPLES)
@click.option(
    "--vehicle", type=click.Choice(["plane", "copter"]), default="copter", show_default=True
)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", default=5760, show_default=True, help="TCP port; UDP on the same number.")
@click.option(
    "--out", "outs", multiple=True, metavar="HOST:PORT", help="Send UDP there; repeatable."
)
@click.option("--speedup", default=1.0, show_default=True, type=click.FloatRange(0.01, 100.0))
@click.option("--seed", default=1, show_default=True, help="Flights, noise and hidden truth.")
@click.option("--imus", default=1, show_default=True, type=click.IntRange(1, 3))
@click.option(
    "--truth",
    "truths",
    multiple=True,
    metavar="SX,SY,SZ,OX,OY,OZ",
    help="Scale and offset of the next accelerometer; default: random by the seed.",
)
@click.option(
    "--flights", default=1000, show_default=True, help="Flights to fly by itself; 0: on command."
)
@click.option(
    "--duration",
    default=180.0,
    show_default=True,
    type=click.FloatRange(60.0, 3600.0),
    help="Length of a flight, s; on command, 300 at least.",
)
@click.option(
    "--ground",
    default=20.0,
    show_default=True,
    type=click.FloatRange(3.0),
    help="Time on the ground before each flight, s.",
)
@click.option("--dull", is_flag=True, help="Hover, or fly straight.")
@click.option(
    "--loop-rate", type=click.IntRange(50, 1000), help="Main loop, Hz [plane 50, copter 400]."
)
def sim(
    vehicle: Vehicle,
    host: str,
    port: int,
    outs: tuple[str, ...],
    speedup: float,
    seed: int,
    imus: int,
    truths: tuple[str, ...],
    flights: int,
    duration: float,
    ground: float,
    dull: bool,  # noqa: FBT001 - click passes options by name
    loop_rate: int | None,
) -> None:
    """Run a simulated ArduPilot whose accelerometers are off by a known amount.

    It stands, arms, flies, lands and starts over, and speaks MAVLink on TCP and UDP.
    """  # fmt: skip
    chosen = [parse_truth(text) for text in truths]
    hardware = (*chosen, *random_imus(seed, max(imus, len(chosen)))[len(chosen) :])
    autopilot = Autopilot(
        vehicle,
        Truth(imus=hardware, seed=seed),
        loop_rate=loop_rate,
        dull=dull,
        longest=max(duration, FLIGHT_DURATION),
    )
    mission = Mission(flights, duration, ground)
    server = Server(autopilot, speedup=speedup, driver=mission)
    for line in describe(hardware):
        click.echo(line)
    sys.stdout.flush()
    asyncio.run(_serve(server, host, port, [parse_address(text) for text in outs]))


async def _serve(server: Server, host: str, port: int, outs: Sequence[tuple[str, int]]) -> None:
    try:
        port = await server.listen_tcp(host, port)
        await server.listen_udp(host, port)
        for target in outs:
            await server.connect_udp(*target)
    except OSError as error:
        raise UsageError(f"cannot open {host}:{port}: {error.strerror or error}") from error
    click.echo(f"listening on tcp:{host}:{port} and udp:{host}:{port}; Ctrl-C ends it")
    sys.stdout.flush()
    await server.run()


def parse_truth(text: str) -> ImuTruth:
    """Six numbers with commas between them.

    Raises:
        UsageError: not six numbers, or a scale that is not positive.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != SIX or min(numbers[:3]) <= 0.0:
        raise UsageError(f"--truth {text!r}: expected six numbers, scale x,y,z and offset x,y,z")
    sx, sy, sz, ox, oy, oz = numbers
    return ImuTruth(scale=(sx, sy, sz), offset=(ox, oy, oz))


def parse_address(text: str) -> tuple[str, int]:
    """HOST:PORT.

    Raises:
        UsageError: anything else.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise UsageError(f"--out {text!r}: expected HOST:PORT")
    return host, int(port)


def describe(imus: Sequence[ImuTruth]) -> list[str]:
    """The hidden truth, as the parameters that would be right."""
    lines = []
    for number, imu in enumerate(imus, start=1):
        stem = "INS_ACC" + ("" if number == 1 else str(number))
        scale = ", ".join(f"{x:.4f}" for x in imu.scale)
        offset = ", ".join(f"{x:+.4f}" for x in imu.offset)
        lines.append(f"accelerometer {number}: right {stem}SCAL {scale}; {stem}OFFS {offset}")
    return lines

"""``onboard demo``: a simulated autopilot and the service, from the first flight to the proof.

The autopilot runs in a process of its own and is reached over UDP, as a real one would be; the
service is the one that ``onboard run`` starts.  The hidden truth is known only to the
simulator and to the table in the end.
"""

from __future__ import annotations

import asyncio
import logging
import signal
import sys
import tempfile
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from onboard.cli.demo_pace import Heard, keep
from onboard.cli.terminal import Terminal
from onboard.daemon.process.interrupts import stop_signals
from onboard.errors import OnboardError

if TYPE_CHECKING:
    from onboard.cli.demo_report import Outcome
    from onboard.cli.demo_show import Show
    from onboard.daemon.process.service import Service
    from sitl.builtin.world import Vehicle
    from sitl.station import Station

VEHICLE: Vehicle = "copter"
SEED = 11
SPEEDUP = 12.0
LANDING_S = 120.0
FIRST_FLIGHT_S, PROOF_FLIGHT_S = 200.0, 90.0
POLL_S = 0.25
PATIENCE_S = 400.0
"""Wall-clock seconds for what follows a flight; on an idle computer it takes ten.  Only ends a
demonstration that is hopeless."""


class DemoError(OnboardError):
    """The demonstration did not show what it should; says what is missing."""

    exit_status = 1


@dataclass(frozen=True, slots=True)
class Options:
    """What the command line asks for; times in simulated seconds.

    ``stays``: the page is kept when all is done, until somebody ends it.
    """

    duration: float
    port: int
    speedup: float
    seed: int
    stays: bool


EXAMPLES = """\
\b
onboard demo
onboard demo --port 8191     # look at http://127.0.0.1:8191, until Ctrl-C
onboard demo --once          # end when it is done, on a terminal too
onboard demo --seed 5 --duration 400 --json result.json
"""


@click.command(epilog=EXAMPLES)
@click.option("--json", "json_file", metavar="F", help="Write the result as JSON; - is stdout.")
@click.option(
    "--duration",
    default=FIRST_FLIGHT_S,
    show_default=True,
    type=click.FloatRange(120.0, 1800.0),
    help="Length of the first flight, s of simulated time.",
)
@click.option(
    "--port",
    default=0,
    type=click.IntRange(0, 65535),
    help="Port of the status page on 127.0.0.1 [a free one].",
)
@click.option(
    "--speedup",
    default=SPEEDUP,
    show_default=True,
    type=click.FloatRange(1.0, 50.0),
    help="Simulated seconds a second.",
)
@click.option("--seed", default=SEED, show_default=True, help="Of truth, manoeuvres and noise.")
@click.option(
    "--once", is_flag=True, help="End when it is done; on a terminal the page stays until Ctrl-C."
)
def demo(
    json_file: str | None,
    duration: float,
    port: int,
    speedup: float,
    seed: int,
    *,
    once: bool,
) -> None:
    """Fly a simulated autopilot, calibrate it, and fly again to see that it was right.

    Two accelerometers are off by some per cent and some tenths of m/s^2.  The service finds
    out by how much while the vehicle flies, writes the parameters after the landing and reads
    them back; a second flight shows the residual that is left.  Where a person watches, the
    page stays until Ctrl-C.
    """
    logging.getLogger("onboard").addHandler(logging.NullHandler())
    out = Terminal(stderr=json_file == "-", highlight=False)
    options = Options(duration, port, speedup, seed, stays=sys.stdout.isatty() and not once)
    try:
        outcome = asyncio.run(_demonstrate(options, out, json_file))
    except asyncio.CancelledError:  # SIGTERM: the simulated autopilot has been ended, too
        raise KeyboardInterrupt from None
    if outcome.shortcomings:
        raise DemoError("; ".join(outcome.shortcomings))


def _tell(outcome: Outcome, out: Terminal, json_file: str | None) -> None:
    """The result, for people and for programs."""
    from onboard.cli.demo_report import report

    for part in report(outcome):
        out.print(part)
    if json_file is not None:
        document = outcome.document().to_json()
        if json_file == "-":
            click.echo(document, nl=False)
        else:
            Path(json_file).write_bytes(document)


async def _demonstrate(options: Options, out: Terminal, json_file: str | None) -> Outcome:
    from onboard.cli.demo_report import Outcome
    from onboard.cli.demo_show import Show
    from onboard.daemon.process.service import Service
    from onboard.daemon.setup import configuration
    from sitl.builtin.process import autopilot_process
    from sitl.builtin.truth import random_imus

    task = asyncio.current_task()
    if task is not None:
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    imus = random_imus(options.seed, 2)
    with Show(out) as show, tempfile.TemporaryDirectory(prefix="onboard-demo-") as folder:
        show.stage("starting a simulated ArduPilot copter, two accelerometers, clearly off")
        async with autopilot_process(
            VEHICLE,
            imus,
            speedup=options.speedup,
            seed=options.seed,
            longest=options.duration + LANDING_S,
        ) as sim_port:
            service = Service(
                configuration.from_mapping(
                    {
                        "link": {"endpoints": [f"udpout:127.0.0.1:{sim_port}"]},
                        "state": {"directory": folder},
                        "http": {"port": options.port},
                    },
                    source="demo",
                )
            )
            running = asyncio.create_task(service.run(), name="service")
            try:
                await _first(running, _fly_twice(service, sim_port, options, show))
                show.end()
                outcome = Outcome.of(service, imus, options.duration)
                _tell(outcome, out, json_file)
                if options.stays and service.server is not None:
                    await _stay(out, service.server.url)
            finally:
                service.stop()
                await asyncio.gather(running, return_exceptions=True)
        return outcome


async def _stay(out: Terminal, url: str) -> None:
    """Keep the page for whoever looks, until Ctrl-C."""
    out.print(f"the status page stays at {url}; Ctrl-C ends it")
    asked = asyncio.Event()
    with stop_signals(lambda _: asked.set()):
        await asked.wait()
    out.print()


async def _fly_twice(service: Service, sim_port: int, options: Options, show: Show) -> None:
    """The demonstration itself, stage by stage."""
    from sitl.station import Station

    await service.ready.wait()
    async with Station.at("127.0.0.1", sim_port) as station:
        show.watch(service, station)
        if service.server is not None:
            show.stage(f"status page: {service.server.url}")
        show.stage("the service reads the parameters and asks for its message rates")
        await _until(lambda: service.snapshot().trust.open, "GPS to be trusted", PATIENCE_S)
        show.stage(f"first flight: {options.duration:.0f} s of random manoeuvres")
        await _flight(service, station, options.duration, options.speedup)
        show.stage("landed; the service writes when it has been disarmed for 5 s")
        wanted = set(range(1, len(service.snapshot().imus) + 1))
        await _until(
            lambda: set(service.snapshot().push.can_roll_back) >= wanted,
            "the parameters to be written",
            PATIENCE_S,
        )
        show.stage("parameters are written and read back")
        show.stage(f"second flight, {PROOF_FLIGHT_S:.0f} s: is the residual smaller now?")
        await _flight(service, station, PROOF_FLIGHT_S, options.speedup)
        await _until(
            lambda: {w.imu for w in service.snapshot().push.written if w.verdict} >= wanted,
            "the verdict on the second flight",
            PATIENCE_S,
        )
        show.stage("done")


async def _flight(service: Service, station: Station, seconds: float, speedup: float) -> None:
    """Up and down again; on the ground, where nothing is to be seen, in real time."""
    pacing = asyncio.create_task(keep(station, Heard(service), speedup), name="pace")
    try:
        await station.take_off()
        await station.until_time(station.time + seconds)
        await station.land()
        await station.until_disarmed()
    finally:
        pacing.cancel()
        await asyncio.gather(pacing, return_exceptions=True)
    station.set_pace(1.0)


async def _until(condition: Callable[[], bool], what: str, limit_s: float) -> None:
    try:
        async with asyncio.timeout(limit_s):
            while not condition():  # noqa: ASYNC110 - a snapshot is asked for, never announced
                await asyncio.sleep(POLL_S)
    except TimeoutError:
        raise DemoError(f"waited {limit_s:.0f} s in vain for {what}") from None


async def _first(running: asyncio.Task[None], work: Coroutine[None, None, None]) -> None:
    """Does the work unless the service ends before it, which is a failure of the service."""
    task = asyncio.create_task(work, name="demonstration")
    await asyncio.wait({running, task}, return_when=asyncio.FIRST_COMPLETED)
    if not task.done():
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await running
        raise DemoError("the service ended early")
    await task

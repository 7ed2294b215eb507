"""Boots a clean root with systemd and starts the service there: ``try_boot.py BASE WORK``.

As ``try_install.py BASE WORK pipx``, but in a system that runs: ``onboard service install --start``
is left to systemd, with the unit's dynamic user and all that it shuts off, and is timed until the
service sees a simulated vehicle.  Needs root, systemd-nspawn and the package registries.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from try_install import APT, CleanRoot, install, prepare, step

BOOTED_WITHIN_S = 180.0
LOG = "try.log"
UNIT = f"""\
[Unit]
After=multi-user.target
[Service]
Type=oneshot
StandardOutput=append:/{LOG}
StandardError=append:/{LOG}
ExecStart=/bin/sh /try.sh
"""
SCRIPT = """\
now() { date +%s.%N; }
begun=$(now)
onboard service install --endpoint udpin:127.0.0.1:14550 --start && systemctl is-active onboard
echo "started $begun $(now)"
onboard sim --out 127.0.0.1:14550 >/dev/null 2>&1 &
for k in $(seq 120); do
    if onboard status --json 2>/dev/null | grep -q '"state":"present"'; then
        echo "seen $begun $(now)"
        break
    fi
    sleep 0.2
done
systemctl show onboard --property=User,DynamicUser,StatusText
systemctl is-enabled onboard
systemctl poweroff
"""


def boot(root: CleanRoot) -> None:
    """Let it run the script, and end."""
    (root.place / "try.sh").write_text(SCRIPT, encoding="utf-8")
    units = root.place / "etc/systemd/system"
    (units / "try.service").write_text(UNIT, encoding="utf-8")
    wanted = units / "multi-user.target.wants"
    wanted.mkdir(exist_ok=True)
    (wanted / "try.service").symlink_to("../try.service")
    (root.place / "etc/machine-id").write_text("", encoding="utf-8")
    words = ["systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--private-network"]
    subprocess.run(  # noqa: S603
        [*words, "--directory", str(root.place), "--boot"],
        check=False,  # that it was shut down is no success to nspawn everywhere
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        timeout=BOOTED_WITHIN_S,
    )


def main() -> None:
    """Install, boot, and tell what the booted system has said."""
    base, work = Path(sys.argv[1]), Path(sys.argv[2])
    if os.geteuid() != 0 or shutil.which("systemd-nspawn") is None:
        raise SystemExit("booting needs root and systemd-nspawn (Debian: systemd-container)")
    work.mkdir(parents=True)
    root = CleanRoot(base, work / "root")
    prepare(root)
    install(root, "pipx", work, base)
    root.run(*APT, "systemd", "systemd-sysv", "dbus")
    step("booted, and shut down again", root, lambda: boot(root))
    told = (root.place / LOG).read_text(encoding="utf-8").splitlines()
    for line in told:
        what, *times = line.split()
        if what in {"started", "seen"}:
            begun, ended = map(float, times)
            sys.stdout.write(f"{ended - begun:6.1f} s  onboard service install --start: {what}\n")
        else:
            sys.stdout.write(f"          {line}\n")
    if not any(line.startswith("seen") for line in told):
        raise SystemExit("the service has seen no vehicle")


if __name__ == "__main__":
    main()

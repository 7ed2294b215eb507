"""What other readers say of a log."""

from __future__ import annotations

from pathlib import Path

from pymavlink.DFReader import DFReader_binary


def pymavlink_records(path: Path) -> dict[str, list]:
    """Every record of a DataFlash log as pymavlink reads it, by name, in order."""
    out: dict[str, list] = {}
    reader = DFReader_binary(str(path))
    try:
        while (message := reader.recv_msg()) is not None:
            out.setdefault(message.get_type(), []).append(message)
    finally:
        reader.close()
    return out

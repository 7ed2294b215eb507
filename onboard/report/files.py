"""Reports, documents and parameters as files."""

from __future__ import annotations

from pathlib import Path

from onboard.errors import UsageError


def beside(file: Path) -> Path:
    """Where a file is written before it takes its place, whole."""
    return file.with_name(f".{file.name}.part")


def save(content: str | bytes, file: str | Path) -> Path:
    """Write a document to a file, text in UTF-8; returns its path.

    Raises:
        UsageError: the file cannot be written.
    """
    path = Path(file)
    try:
        path.write_bytes(
            content.encode("utf-8", "replace") if isinstance(content, str) else content
        )
    except OSError as error:
        raise UsageError(f"{file}: cannot be written ({error.strerror})") from None
    return path

"""The messages asked for, of a recording of any kind, as structured arrays."""

from __future__ import annotations

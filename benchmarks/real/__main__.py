"""``python -m benchmarks.real``: everything about real flights, as tables and as JSON."""

from __future__ import annotations

from benchmarks.real.runner import main

if __name__ == "__main__":
    main()

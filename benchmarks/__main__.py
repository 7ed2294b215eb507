"""``make bench``: every benchmark in one run, side by side."""

from __future__ import annotations

import argparse

from benchmarks import accuracy, coverage, daemon, explaining, link


def main() -> None:
    """Run what is asked for; all of it by default."""
    parser = argparse.ArgumentParser(prog="benchmarks", description=__doc__)
    parser.add_argument("--flights", type=int, default=20, help="simulated flights for coverage")
    parser.add_argument("--recordings", type=int, default=40, help="concealed-effect recordings")
    chosen = parser.parse_args()
    print("## Accuracy on recordings with known answers")
    accuracy.main([])
    print("\n## Honesty of the sigmas on simulated flights")
    coverage.main(["--count", str(chosen.flights)])
    print("\n## Concealed effects, sealed answers")
    explaining.main(["--count", str(chosen.recordings)])
    print("\n## Cost")
    for name, value, unit in (*link.run(), *daemon.run()):
        print(f"{name:50} {value:10.3g} {unit}")


if __name__ == "__main__":
    main()

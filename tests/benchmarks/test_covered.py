"""The table of coverage adds files up by package, and nothing twice."""

from benchmarks.covered import by_package, rows


def summary(lines, lines_of, branches, branches_of):
    return {
        "summary": {
            "covered_lines": lines,
            "num_statements": lines_of,
            "covered_branches": branches,
            "num_branches": branches_of,
        }
    }


def test_files_are_added_up_by_package_and_room():
    found = by_package(
        {
            "files": {
                "onboard/__init__.py": summary(1, 2, 0, 0),
                "onboard/push/plan.py": summary(9, 10, 3, 4),
                "onboard/core/gps/trust.py": summary(5, 10, 1, 4),
                "onboard/core/gps/held.py": summary(10, 10, 4, 4),
                "onboard/core/maths/sums.py": summary(0, 5, 0, 0),
            }
        }
    )
    assert (found["`onboard/core/gps`"].lines, found["`onboard/core`"].lines_of) == (15, 25)
    assert (found["all"].lines, found["all"].lines_of, found["all"].branches_of) == (25, 37, 12)
    table = list(rows(found))
    assert table[-1] == "| all | 67.6 % | 37 | 66.7 % | 12 |"
    assert "| `onboard` | 50.0 % | 2 | - | 0 |" in table

"""The same with numpy's arithmetic and with compiled loops."""

from onboard.core.maths.compiling import compiled_loops, prefer_compiled


def both_ways(what):
    """Something with numpy, then with compiled loops; those are preferred afterwards."""
    prefer_compiled(yes=False)
    one = what()
    prefer_compiled()
    assert compiled_loops() is not None
    return one, what()

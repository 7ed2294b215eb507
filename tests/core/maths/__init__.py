"""Tests of ``core.maths``."""

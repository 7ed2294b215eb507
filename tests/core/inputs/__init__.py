"""Tests of ``core.inputs``."""

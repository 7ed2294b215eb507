"""Tests of ``push``."""

"""Tests of ``mavlink``."""

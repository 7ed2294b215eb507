"""Tests of ``daemon``."""

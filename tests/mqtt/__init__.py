"""Tests of ``mqtt``."""

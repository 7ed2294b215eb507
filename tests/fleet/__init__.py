"""Tests of ``answers.fleet`` and of its pages."""

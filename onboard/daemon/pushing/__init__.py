"""Estimates to parameters: proposals, approvals, the writing, and the flight that judges it."""

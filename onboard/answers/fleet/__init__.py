"""What is said of many recordings: which vehicle each is of, what its numbers do over time."""

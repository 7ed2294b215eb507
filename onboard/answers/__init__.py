"""What is said of a flight, to files and by the daemon: one answer, its advice, its documents."""

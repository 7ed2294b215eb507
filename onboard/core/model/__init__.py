"""What is predicted: how each unknown moves the velocity between two fixes."""

"""Days of the service at speed."""

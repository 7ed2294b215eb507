"""What there is to see: one snapshot of the service, and its state in sentences."""

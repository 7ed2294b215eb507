"""What the service was told: its configuration file, turned into settings of the parts."""

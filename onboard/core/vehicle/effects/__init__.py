"""What an airframe may have that its model lacks: one effect, one file."""

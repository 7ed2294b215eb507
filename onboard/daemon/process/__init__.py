"""The process: tasks in one group, signals of the system, the parts put together."""

"""Which effects a recording holds: tried on sums, tested on flight not used, and said."""

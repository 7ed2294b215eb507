"""Pure algebra: frames, the earth, interpolation, block sums, one conversion of scales."""

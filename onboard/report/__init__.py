"""Reports for people: one self-contained HTML page, and parameter files for ground stations."""

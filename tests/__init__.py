"""Every test of the project; a package, so that two rooms may use one file name."""

"""The service: what systemd starts; a link on one side, people and programs on the other.

``configuration`` says what, ``service`` says when, ``snapshot`` is everything that anybody
outside may read, ``control`` is how they read it and ask for changes.
"""

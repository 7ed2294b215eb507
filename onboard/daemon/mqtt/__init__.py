"""The broker's side: what is published, as which document, and how the connection is kept."""

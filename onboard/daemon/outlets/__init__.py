"""Who is told and who may ask: page, parameter view, broker, ground station."""

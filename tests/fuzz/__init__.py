"""Any bytes, wherever bytes come in: a result or a named error, in bounded time and memory."""

"""Messages to the page: snapshots as tables packed into bytes, state and events as JSON."""

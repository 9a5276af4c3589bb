"""Which wall a device can render, with which element, and why a contact buzzes."""

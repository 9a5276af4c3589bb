"""The largest stable gains, searched over elements, tasks and variations of the device."""

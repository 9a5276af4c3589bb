"""No test fails for being slow: the machine that runs it may be busy. Nor for being run in the background."""

import signal

from hypothesis import HealthCheck, settings

settings.register_profile("haploop", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("haploop")
# A shell has its background jobs ignore Ctrl-C, and what they start inherits that.
signal.signal(signal.SIGINT, signal.default_int_handler)

"""No test fails for being slow: the machine that runs it may be busy."""

from hypothesis import HealthCheck, settings

settings.register_profile("haploop", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("haploop")

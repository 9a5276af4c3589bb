"""The base of every validating model of a table."""

from pydantic import BaseModel, ConfigDict


class Model(BaseModel):
    """Validates a TOML table: unknown keys are mistakes and nothing is converted silently."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True, protected_namespaces=())

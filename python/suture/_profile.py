"""Profiles: what a repair may do."""

from __future__ import annotations

import json
from typing import Any

from . import _suture

PROFILES = ("default", "fast", "strict", "cautious", "scan", "inspect-only")
"""Names of the profiles that come with the engine."""


def built_in_profile(name: str = "default") -> dict[str, Any]:
    """All settings of a profile that comes with the engine. The README of Suture explains each."""
    return json.loads(_suture.built_in_profile(name))


def _plain(value: Any) -> Any:
    """A number of numpy as one of Python."""
    if hasattr(value, "item"):
        return value.item()
    raise ValueError(f"no setting of a profile is {value!r}")


def profile_text(profile: str | dict[str, Any]) -> str:
    """The profile as the engine reads it. Settings that a dictionary leaves out are those of ``default``."""
    return profile if isinstance(profile, str) else json.dumps(profile, allow_nan=False, default=_plain)

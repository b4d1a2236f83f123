"""Profiles: what a repair may do."""

from __future__ import annotations

import json
from typing import Any

from . import _suture

PROFILES = ("default", "scan", "cautious")
"""Names of the profiles that come with the engine."""


def built_in_profile(name: str = "default") -> dict[str, Any]:
    """All settings of a profile that comes with the engine. The README of Suture explains each."""
    return json.loads(_suture.built_in_profile(name))


def profile_text(profile: str | dict[str, Any]) -> str:
    """The profile as the engine reads it. Settings that a dictionary leaves out are those of ``default``."""
    return profile if isinstance(profile, str) else json.dumps(profile, allow_nan=False)

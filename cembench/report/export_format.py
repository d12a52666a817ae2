"""The formats of an exported table, in their own module so that the command line loads quickly."""

from __future__ import annotations

from enum import StrEnum


class Format(StrEnum):
    """Export formats."""

    csv = "csv"
    parquet = "parquet"
    json = "json"

"""Summaries of a run over many surfaces, in place of a page for each."""

from __future__ import annotations

#: With more surfaces than this, runs are summarised instead of shown cell by cell.
MANY = 24

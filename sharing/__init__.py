"""Runs that are sent to others, collected and published: bundles, their checks, a site."""

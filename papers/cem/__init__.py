"""The paper whose tables, claims and figures cembench regenerates: all of it that is data."""

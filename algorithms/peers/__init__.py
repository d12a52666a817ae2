"""Third-party algorithms: libraries and programs, which run where they are installed."""

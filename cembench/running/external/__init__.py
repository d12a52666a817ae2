"""Run and measure external programs and libraries as algorithms."""

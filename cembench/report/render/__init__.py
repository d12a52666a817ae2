"""The forms of a report: HTML, LaTeX, Markdown, CSV, terminal."""

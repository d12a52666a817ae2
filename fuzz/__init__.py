"""A fuzz campaign against cembench: files, meshes and kills, judged by code of its own.

``python -m fuzz`` (or ``make fuzz``) runs it. The oracles share no code with the package: the
readers in :mod:`fuzz.reading` follow the formats' specifications, :mod:`fuzz.exact` decides with
rational numbers, :mod:`fuzz.decoys` compares folders. The package is used through the few names
that :mod:`fuzz.project` imports, and through its command line.
"""

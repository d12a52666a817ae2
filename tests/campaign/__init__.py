"""A fuzz campaign against cembench: files, meshes and kills, judged by code of its own.

``python -m tests.campaign`` (or ``make fuzz``) runs it. The oracles share no code with the package:
the readers in :mod:`tests.campaign.reading` follow the formats' specifications,
:mod:`tests.campaign.exact` decides with rational numbers, :mod:`tests.campaign.decoys` compares
folders. What is tested is used through the few names that :mod:`tests.campaign.project` imports,
and through the command line.
"""

"""Is a new solver right, and is it better? What ``cembench validate`` examines, a stage a module.

:mod:`contract` and :mod:`correctness` end in findings, each ok or not; :mod:`quality` and
:mod:`scaling` measure beside a baseline; :mod:`verdict` says all of it in a sentence.
"""

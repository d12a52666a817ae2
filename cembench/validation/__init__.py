"""The stages of ``cembench validate``, one per module.

:mod:`contract` and :mod:`correctness` return findings, each ok or not; :mod:`quality` and
:mod:`scaling` compare with a baseline; :mod:`verdict` sums up the result in a sentence.
"""

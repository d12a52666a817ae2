"""Runs on several machines, by dask.distributed: extra ``cluster``, see ``docs/cluster.md``.

A :class:`~cembench.running.cluster.units.Unit` is sent to a worker: one surface under one policy,
with all its algorithms and rounds. The worker measures it as one machine does, and returns records.
"""

"""Runs on several machines, by dask.distributed: extra ``cluster``, see ``docs/cluster.md``.

What travels is a :class:`~cembench.running.cluster.units.Unit`: one surface under one policy with
all its algorithms and rounds. A worker measures it as one machine does, and sends back records.
"""

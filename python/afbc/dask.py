"""Campaigns on the workers of a Dask cluster.

    from dask.distributed import Client
    import afbc.dask

    with Client("tcp://scheduler:8786") as client:
        afbc.dask.campaign(client, "robustness.toml", shards=64, out="/results/robustness")

The same shards that Slurm and Kubernetes fly (docs/campaigns.md), and the same bytes as on one machine. Tried with
Dask 2026.8.
"""

from __future__ import annotations

from os import PathLike, fspath
from os.path import exists
from pathlib import Path
from typing import Any

from . import _afbc, campaign as _campaign, merge
from ._check import path, whole

__all__ = ["campaign"]

_Path = str | PathLike[str]

#: Most tasks that a scheduler is asked to hold.
SHARDS_MAX = 100_000


def _shard(campaign: str, shard: str, out: str, flights: int | None, vehicle: str | None) -> str:
    """Flies a shard on a worker, with one core, since Dask gives each of a worker's threads a task of its own."""
    _campaign(campaign, flights=flights, vehicle=vehicle, shard=shard, out=out, threads=1)
    return out


def _everywhere(named: str, built_in: list[str]) -> str:
    """Returns the absolute path of a file, which workers in other folders find, or the name of a built-in one."""
    return fspath(Path(named).resolve()) if named not in built_in and exists(named) else named


def campaign(
    client: Any,
    campaign: _Path,
    *,
    out: _Path,
    shards: int,
    flights: int | None = None,
    vehicle: _Path | None = None,
) -> Any:
    """Flies a campaign on the workers of `client`, a `dask.distributed.Client`; returns the data frame of all flights.

    The workers need this package of the same version, and see campaign, vehicle and `out` under the same paths, as on a
    cluster's shared file system. Finished flights are kept in `out`-parts: a shard whose worker has died goes on where
    it was on another one, and so does the whole campaign by the same call. Shards, a task each, should be a few times
    as many as threads of all workers. At the end they are joined into `out`.
    """
    for method in ("submit", "gather"):
        if not callable(getattr(client, method, None)):
            raise TypeError(f"client: a dask.distributed.Client is needed, not {type(client).__name__}")
    campaign, out, shards = path("campaign", campaign), path("out", out), whole("shards", shards, 1, SHARDS_MAX)
    vehicle = None if vehicle is None else path("vehicle", vehicle)
    flights = None if flights is None else whole("flights", flights, 1, 2**63 - 1)
    parts = Path(out).resolve().with_name(Path(out).name + "-parts")
    tasks = [
        client.submit(
            _shard,
            _everywhere(campaign, _afbc.campaigns()),
            f"{index}/{shards}",
            fspath(parts / f"{index:06}"),
            flights,
            None if vehicle is None else _everywhere(vehicle, _afbc.vehicles()),
            pure=False,
        )
        for index in range(1, shards + 1)
    ]
    return merge(client.gather(tasks), out)

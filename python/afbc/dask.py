"""Campaigns on the workers of a Dask cluster.

    from dask.distributed import Client
    import afbc.dask

    with Client("tcp://scheduler:8786") as client:
        afbc.dask.campaign(client, "robustness.toml", shards=64, out="/results/robustness")

The shards are the same as with Slurm and Kubernetes (docs/campaigns.md), and the results have the same bytes as on one
machine. Tested with Dask 2026.8.
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

#: Largest number of tasks that a scheduler gets.
SHARDS_MAX = 100_000


def _shard(campaign: str, shard: str, out: str, flights: int | None, vehicle: str | None) -> str:
    """Flies a shard on a worker. It uses one core, since Dask gives each of a worker's threads its own task."""
    _campaign(campaign, flights=flights, vehicle=vehicle, shard=shard, out=out, threads=1)
    return out


def _everywhere(named: str, built_in: list[str]) -> str:
    """Returns a built-in name as it is, or the absolute path of a file, which workers in other folders also find."""
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
    """Flies a campaign on the workers of `client`, a `dask.distributed.Client`. Returns the data frame of all flights.

    The workers need the same version of this package, and must see campaign, vehicle and `out` under the same paths, as
    on a cluster's shared file system. Finished flights are kept in `out`-parts. If a worker dies, another one continues
    its shard, and the same call resumes a whole campaign. Each shard is a task; there should be a few times as many
    shards as threads of all workers. At the end, the shards are merged into `out`.
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

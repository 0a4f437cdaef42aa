"""The same campaign on a Dask cluster of two workers, one of which is killed on the way."""

import os
import re
import signal
import subprocess
import threading
import time
from pathlib import Path

import pytest
from dask.distributed import Client, LocalCluster

import afbc

ROOT = Path(__file__).resolve().parents[2]

CAMPAIGN = """
name = "robustness"
flights = {flights}
duration_s = 10.0
scenario = "hover"
[spread]
mass_ratio = [0.7, 1.3]
thrust_factor_ratio = [0.3, 1.2]
"""


def kill_one(client: Client, parts: Path, killed: list) -> None:
    """Kills the worker that flies a shard some of whose flights are finished."""
    while not list(parts.glob("*/chunks/*.parquet")):
        time.sleep(0.002)
    for worker, tasks in client.processing().items():
        if tasks:
            [pid] = client.run(os.getpid, workers=[worker]).values()
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)
            return


def recipe() -> str:
    """The example of docs/campaigns.md."""
    [text] = re.findall(r"```python\n([^`]*from dask[^`]*)```", (ROOT / "docs/campaigns.md").read_text())
    return text


def test_the_recipe_gives_the_same_as_one_machine(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sitl = Path(os.environ.get("SITL", ROOT / "target/release/sitl")).resolve()
    (tmp_path / "robustness.toml").write_text(CAMPAIGN.format(flights=192))
    command = [sitl, "campaign", "robustness.toml", "--out", "whole"]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    killed: list = []
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        before = set(client.run(os.getpid).values())
        killer = threading.Thread(target=kill_one, args=(client, tmp_path / "robustness-parts", killed))
        killer.start()
        run, text = {}, recipe()
        for given, here in [
            ("tcp://scheduler:8786", cluster.scheduler_address),
            ("/results/", f"{tmp_path}/"),
            ("shards=64", "shards=4"),
        ]:
            assert given in text
            text = text.replace(given, here)
        exec(compile(text, "docs/campaigns.md", "exec"), run)
        killer.join()
        client.wait_for_workers(2)
        after = set(client.run(os.getpid).values())
    assert killed and killed[0] in before - after, "no worker was killed on the way"
    for name in ["results.parquet", "summary.json", "report.html"]:
        assert (tmp_path / "robustness" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name
    assert run["frame"].equals(afbc.campaign("robustness.toml", out="whole"))


@pytest.mark.parametrize("shard", ["0/3", "4/3", "3", "150/200"])
def test_bad_shards_are_refused_by_the_words_of_the_command_line(shard, tmp_path):
    sitl = Path(os.environ.get("SITL", ROOT / "target/release/sitl")).resolve()
    path = tmp_path / "robustness.toml"
    path.write_text(CAMPAIGN.format(flights=192))
    done = subprocess.run([sitl, "campaign", path, "--shard", shard], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    with pytest.raises(afbc.AfbcError) as raised:
        afbc.campaign(path, shard=shard)
    [words] = re.findall(r"(?:a shard must be|the campaign has).*", str(raised.value))
    assert words in done.stderr

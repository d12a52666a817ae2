"""Two workers on this machine, for all tests that need a cluster."""

import gc
import warnings

import pytest


@pytest.fixture(scope="module")
def cluster_cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def client(cluster_cache):
    pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
    from cembench.running.cluster.connect import connected, parse_cluster

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CEMBENCH_CACHE", str(cluster_cache))
        with connected(parse_cluster("local:2")) as found:
            yield found
    with warnings.catch_warnings():  # sockets that its event loop has left to the collector
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()

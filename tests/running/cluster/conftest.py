"""Two workers on this machine, for all tests that need a cluster."""

import pytest


@pytest.fixture(scope="session")
def cluster_cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def client(cluster_cache):
    pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
    from cembench.running.cluster.connect import connected, parse_cluster

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CEMBENCH_CACHE", str(cluster_cache))
        with connected(parse_cluster("local:2")) as found:
            yield found

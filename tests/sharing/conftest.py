from tests.report.conftest import evidence, small_run

__all__ = ["evidence", "small_run"]

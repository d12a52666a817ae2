from tests.report.conftest import quick_drawing

__all__ = ["quick_drawing"]

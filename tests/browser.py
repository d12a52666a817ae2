"""A real browser without a window; installed where it is missing and can be."""

import os
import shutil
import subprocess
from contextlib import contextmanager
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

#: Names of the program and of what steers it, as distributions have them.
PROGRAMS = ("chromium", "chromium-browser", "google-chrome"), ("chromedriver",)
PACKAGES = ("chromium", "chromium-driver")
ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",  # root has none
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
)


@contextmanager
def open_browser():
    """A browser that keeps its console's messages and every request; skips where there is none."""
    program, driver = _programs()
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for argument in ARGUMENTS:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    browser = webdriver.Chrome(options=options, service=Service(driver))
    try:
        yield browser
    finally:
        browser.quit()


def _programs():
    path = _find()
    if None in path:
        _install()
        path = _find()
    if None in path:
        pytest.skip(
            "NOT CHECKED: pages in a browser; install chromium and chromedriver "
            f"(Debian, as root: apt-get install {' '.join(PACKAGES)})"
        )
    return path


def _find():
    return [next(filter(None, map(shutil.which, names)), None) for names in PROGRAMS]


def _install():
    """Install both where that needs nobody's leave: on Debian, as root."""
    if not Path("/etc/debian_version").exists() or not shutil.which("apt-get") or os.geteuid():
        return
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    for command in (
        ("update", "-qq"),
        ("install", "-qq", "-y", "--no-install-recommends", *PACKAGES),
    ):
        subprocess.run(
            ("apt-get", *command), env=environment, capture_output=True, timeout=300, check=False
        )

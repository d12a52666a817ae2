"""The surface to turn, in Chromium with software GL; pixels tell whether it works."""

import io

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from PIL import Image
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

import cembench
from cembench.report.render.html import write_html
from tests.browser import open_browser
from tests.report.sample_report import sample_report


@pytest.fixture(scope="module")
def browser():
    with open_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return write_html(sample_report(folder), folder).as_uri() + "#surface-0"


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    result = cembench.parameterize(hemi_ellipsoid(600), "harmonic-circle")
    return result.show(tmp_path_factory.mktemp("view") / "bowl.html").as_uri()


def opened(browser, address, size=(1280, 900), scheme="light", script=True):
    media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not script})
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size[0] < 500},
    )
    browser.get("about:blank")
    browser.get(address)
    if not script:
        return None
    wait = WebDriverWait(browser, 120, 0.05)
    wait.until(lambda b: b.find_elements(By.CSS_SELECTOR, ".view.live, .view.off"))
    if browser.find_elements(By.CSS_SELECTOR, ".view.off"):
        return None
    canvas = browser.find_element(By.CSS_SELECTOR, ".view canvas")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    wait.until(lambda _: (pixels(canvas, browser)[1].std(axis=(0, 1)) > 10).any())
    return canvas


def pixels(canvas, browser):
    """The surface's and the image's half, once what was asked for has been drawn."""
    browser.execute_async_script(
        "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))"
    )
    picture = Image.open(io.BytesIO(canvas.screenshot_as_png)).convert("RGB")
    found = np.asarray(picture).astype(float)[4:-4, 4:-4]  # without the mark of the focus
    height, width = found.shape[:2]
    if height > width:
        return found[: height // 2], found[height // 2 :]
    return found[:, : width // 2], found[:, width // 2 :]


def differ(one, other):
    return (np.abs(one - other).max(axis=2) > 30).mean()


def test_a_drag_turns_the_surface_and_a_key_zooms_both(browser, single):
    canvas = opened(browser, single)
    surface, image = pixels(canvas, browser)
    ActionChains(browser).move_to_element_with_offset(
        canvas, -canvas.size["width"] // 4, 0
    ).click_and_hold().move_by_offset(90, 20).release().perform()
    turned, same = pixels(canvas, browser)
    assert differ(surface, turned) > 0.05
    assert differ(image, same) < differ(surface, turned) / 2  # its light turns, not its squares
    canvas.send_keys("+")
    larger = pixels(canvas, browser)
    assert differ(turned, larger[0]) > 0.05
    assert differ(same, larger[1]) > 0.05
    canvas.send_keys(Keys.ARROW_LEFT)
    assert differ(larger[0], pixels(canvas, browser)[0]) > 0.02
    canvas.send_keys("0")
    first = pixels(canvas, browser)
    assert differ(surface, first[0]) < 0.002
    assert differ(image, first[1]) < 0.002


def test_the_switcher_changes_the_image_and_folds_are_red(browser, report):
    canvas = opened(browser, report)
    _, image = pixels(canvas, browser)

    def red(half):
        return ((half[..., 0] > 120) & (half[..., 1] < 60) & (half[..., 2] < 60)).mean()

    assert red(image) == 0
    Select(browser.find_element(By.CSS_SELECTOR, ".view .maps select")).select_by_visible_text(
        "qiem"
    )
    surface, folded = pixels(canvas, browser)
    assert differ(image, folded) > 0.02
    assert red(folded) > 0.005
    assert red(surface) > 0.005
    assert "Folded triangles are red" in browser.find_element(By.CSS_SELECTOR, ".view .told").text


def test_every_colouring_looks_different_and_has_a_scale(browser, single):
    canvas = opened(browser, single)
    modes = Select(browser.find_element(By.CSS_SELECTOR, ".view .modes select"))
    seen = []
    for k in range(len(modes.options)):
        modes.select_by_index(k)
        seen.append(pixels(canvas, browser)[1])
        scale = browser.find_element(By.CSS_SELECTOR, ".view .scale")
        assert scale.is_displayed() == (k > 0)
    for k in range(len(seen)):
        assert all(differ(seen[k], other) > 0.02 for other in seen[:k])


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1280, 900), (390, 844)])
def test_it_stands_on_the_page_s_own_ground(browser, single, size, scheme):
    canvas = opened(browser, single, size, scheme)
    surface, _ = pixels(canvas, browser)
    corner = surface[2:6, 2:6].mean()
    assert (corner < 60) if scheme == "dark" else (corner > 240)
    overflow = "return document.documentElement.scrollWidth - innerWidth"
    assert browser.execute_script(overflow) <= 0
    assert (canvas.size["height"] > canvas.size["width"]) == (size[0] < 500)


def test_without_webgl_or_scripts_the_picture_stays(browser, single):
    opened(browser, single, script=False)
    assert browser.find_element(By.CSS_SELECTOR, "body > img").is_displayed()
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    added = browser.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument",
        {"source": "HTMLCanvasElement.prototype.getContext = () => null"},
    )
    try:
        assert opened(browser, single) is None
        assert browser.find_element(By.CSS_SELECTOR, "body > img").is_displayed()
        assert not browser.find_elements(By.CSS_SELECTOR, ".view .controls")
    finally:
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


def test_nothing_is_asked_for_and_nothing_complains(browser, single):
    for kind in ("browser", "performance"):
        browser.get_log(kind)
    opened(browser, single)
    asked = [entry["message"] for entry in browser.get_log("performance")]
    assert not any('"url":"http' in message for message in asked)
    items = [entry["message"] for entry in browser.get_log("browser")]
    assert [words for words in items if "GL" not in words] == []

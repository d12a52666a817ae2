"""The page of a report, as Chromium shows it."""

import base64
import io
import json

import pytest
from PIL import Image
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from cembench.report.render.html import write_html
from tests.browser import open_browser
from tests.report.sample_report import ALGORITHMS, HOSTILE, SURFACES, sample_report

DESKTOP, PHONE = (1280, 900), (390, 844)
#: Every visible text whose contrast (WCAG 2.2, relative luminance) is below 4.5.
CONTRASTS = """
const shown = (colour) => {
  const context = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
  context.fillStyle = colour; context.fillRect(0, 0, 1, 1);
  return [...context.getImageData(0, 0, 1, 1).data];
};
const light = ([r, g, b]) => [r, g, b].map(v => v / 255)
  .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
  .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
const behind = (node) => {
  for (; node; node = node.parentElement) {
    const colour = shown(getComputedStyle(node).backgroundColor);
    if (colour[3] === 255) return colour;
  }
};
const faint = {};
for (const node of document.querySelectorAll('body *:not(script)')) {
  const words = [...node.childNodes].filter(n => n.nodeType === 3).map(n => n.data.trim()).join('');
  if (!words || !node.checkVisibility()) continue;
  const style = getComputedStyle(node);
  if (style.opacity === '0') continue;
  const colour = node.closest('svg') ? style.fill : style.color;
  const [a, b] = [light(shown(colour)), light(behind(node))].sort((x, y) => y - x);
  const contrast = (a + 0.05) / (b + 0.05);
  if (contrast < 4.5) faint[words.slice(0, 30)] = contrast;
}
return faint;
"""


@pytest.fixture(scope="module")
def browser():
    with open_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return write_html(sample_report(folder), folder).as_uri()


@pytest.fixture
def page(browser, address):
    """The report, freshly opened; calls give a part of it, wait, or run a script."""
    browser.get("about:blank")
    for kind in ("browser", "performance"):
        browser.get_log(kind)

    class Page:
        def open(self, anchor="", size=DESKTOP, scheme="light", script=True):
            media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
            metrics = {"deviceScaleFactor": 1, "mobile": size == PHONE}
            self.tell("Emulation.setEmulatedMedia", **media)
            self.tell("Emulation.setScriptExecutionDisabled", value=not script)
            # Without it a page that has not the focus may be told of none.
            self.tell("Emulation.setFocusEmulationEnabled", enabled=True)
            self.tell(
                "Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], **metrics
            )
            browser.get(address + anchor)
            return self

        def tell(self, command, **parameters):
            return browser.execute_cdp_cmd(command, parameters)

        def run(self, script, *arguments):
            return browser.execute_script(script, *arguments)

        def one(self, selector):
            return self.wait(lambda: self.all(selector))[0]  # a script may yet make it

        def click(self, selector):
            """Where the thing is once plots above it have been drawn, and the page stays still."""
            element, places = self.one(selector), []
            self.run(
                "window.reached = false; arguments[0].scrollIntoView({block: 'center'});"
                "const reach = () => { window.reached = true; };"
                "arguments[0].addEventListener('click', reach, {once: true, capture: true})",
                element,
            )

            def still():
                places.append(self.run("return arguments[0].getBoundingClientRect().top", element))
                return len(places) > 3 and len(set(places[-3:])) == 1

            def clicked():  # a plot may push it away at the last moment
                if not still():
                    return False
                element.click()
                places.clear()
                return self.run("return window.reached")

            self.wait(clicked)

        def all(self, selector):
            return browser.find_elements(By.CSS_SELECTOR, selector)

        def wait(self, condition):
            return WebDriverWait(browser, 300, 0.05).until(lambda _: condition())

        def column(self, place, part="tbody"):
            return [cell.text for cell in self.all(f"#times {part} tr > :nth-child({place})")]

        def plot(self):
            self.run("document.querySelector('figure.plot').scrollIntoView()")
            self.wait(lambda: self.run("return !!document.querySelector('.drawn.settled')"))
            return self.all("figure.plot .drawn .scatterlayer .point")

        def boxes(self, selector):
            result = self.run(
                "return [...document.querySelectorAll(arguments[0])]"
                ".map(e => e.getBoundingClientRect()).map(b => [b.left, b.top, b.bottom])",
                selector,
            )
            assert result, selector
            return result

        def overflow(self):
            return self.run(
                "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
            )

    yield Page()
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


def visible(elements):
    return [element for element in elements if element.is_displayed()]


def test_the_whole_page_works_without_a_message_or_a_request(page, browser, address):
    page.open()
    page.plot()
    page.click("figure.plot .modebar-btn[data-title='Zoom in']")
    page.click(".figure-link")
    page.open("#surface-1")
    page.click(".page.current .enlarge")
    assert page.one("#viewer").is_displayed()

    assert browser.get_log("browser") == []
    sent = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [
        m["params"]["request"]["url"] for m in sent if m["method"] == "Network.requestWillBeSent"
    ]
    assert {url.split("#")[0] for url in asked if not url.startswith(("data:", "blob:"))} == {
        address
    }


def test_a_plot_is_drawn_and_zooms(page):
    page.open()
    assert len(page.plot()) == 3
    assert not page.one("figure.plot .canvas > img").is_displayed()
    ticks = "return document.querySelector('.drawn').layout.xaxis.range.join()"
    before = page.run(ticks)
    page.click("figure.plot .modebar-btn[data-title='Zoom in']")
    page.wait(lambda: page.run(ticks) != before)


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_the_panels_and_the_legend_of_a_plot_have_their_own_places(page, size):
    page.open(size=size)
    page.plot()
    first, second = page.boxes("figure.plot .cartesianlayer > .subplot")
    if size == PHONE:
        assert second[1] > first[2]
    else:
        assert second[0] > first[0]
        assert second[1] == pytest.approx(first[1], abs=60)
    lowest = max(box[2] for box in page.boxes("figure.plot [class^='x'][class$='tick'] text"))
    assert page.boxes("figure.plot .legend")[0][1] >= lowest
    caption = page.boxes("figure.plot figcaption")[0]
    assert page.boxes("figure.plot .legend")[0][2] <= caption[1]


def test_tables_sort_by_value_with_gaps_last_and_footers_in_place(page):
    page.open()
    faces, printed_fdm = 2, 5
    original, footers = page.column(1), page.column(1, "tfoot")
    assert original[0] == "Foot"

    button = page.one(f"#times thead tr:last-child th:nth-child({faces}) button")
    button.click()
    button.click()
    assert page.column(faces) == ["22,966", "21,966", "20,966", "19,966"]
    head = page.one(f"#times thead tr:last-child th:nth-child({faces})")
    assert head.get_attribute("aria-sort") == "descending"

    button = page.one(f"#times thead tr:last-child th:nth-child({printed_fdm}) button")
    for order in ("ascending", "descending"):
        button.send_keys(Keys.ENTER)
        head = page.one(f"#times thead tr:last-child th:nth-child({printed_fdm})")
        assert head.get_attribute("aria-sort") == order
        assert page.column(1)[-1] == "Foot"
    button.send_keys(Keys.SPACE)
    assert page.column(1) == original
    assert page.column(1, "tfoot") == footers == ["Mean", "n"]


def test_a_number_opens_its_record_and_the_record_has_an_address(page, browser):
    page.open()
    page.click("#times .figure-link")
    record = page.wait(lambda: visible(page.all("#record-shown[open]")))[0]
    assert "Foot · cem" in record.text
    assert "seconds of each round\n0.1, 0.2, 0.3 s" in record.text
    assert "laplacian 0.01" not in record.text
    page.click("#record-shown summary")
    assert "laplacian 0.01" in page.one("#record-shown").text
    where = browser.current_url.partition("#")
    assert where[2].startswith("record-")

    page.click("#record-shown .close")
    page.wait(lambda: not visible(page.all("#record-shown")))
    assert "record-" not in browser.current_url

    browser.get("about:blank")
    page.open("#" + where[2])
    page.wait(lambda: "Foot · cem" in page.one("#record-shown").text)


def test_a_gap_tells_its_cause_to_the_keyboard(page):
    page.open()
    page.run("document.querySelector('#times .why').focus()")
    page.wait(lambda: page.one("#tip").text == "printed as a dash")
    # The browser scrolls to what has the focus, and tells of it a little later.
    page.run("scrollBy(0, 40); addEventListener('scroll', () => setTimeout(() => window.told = 1))")
    page.wait(lambda: page.run("return window.told"))
    assert page.one("#tip").text == "printed as a dash"
    gap, tip = page.boxes("#times .why")[0], page.boxes("#tip")[0]
    assert min(abs(gap[1] - tip[2]), abs(gap[2] - tip[1])) < 12
    # A pointer that rests elsewhere leaves things as they scroll away beneath it.
    page.run(
        "const left = new PointerEvent('pointerout', {bubbles: true, pointerType: 'mouse'});"
        "document.querySelector('h1').dispatchEvent(left)"
    )
    assert page.one("#tip").text == "printed as a dash"


def test_each_surface_has_a_page_with_its_pictures_and_neighbours(page, browser):
    page.open()
    assert not visible(page.all(".page"))
    page.all(".cards a")[1].click()
    page.wait(lambda: visible(page.all("#surface-1")))
    assert [h.text for h in visible(page.all("h1, h2"))] == [SURFACES[1]]
    assert len(visible(page.all("#surface-1 .side-by-side img"))) == len(ALGORITHMS)
    tops = {image.location["y"] for image in page.all("#surface-1 .side-by-side img")[:3]}
    assert len(tops) == 1

    page.click("#surface-1 .after")
    page.wait(lambda: visible(page.all("#surface-2")))
    page.click("#surface-2 .back")
    page.wait(lambda: visible(page.all("#surfaces")))
    assert not visible(page.all(".page"))
    browser.back()
    page.wait(lambda: visible(page.all("#surface-2")))


def test_a_picture_is_enlarged_zoomed_and_compared_in_the_same_window(page):
    page.open("#surface-0")
    page.click("#surface-0 .enlarge")
    transform = "return document.querySelector('#viewer img').style.transform"
    fitted = page.run(transform)
    viewer = page.one("#viewer")
    viewer.send_keys("+")
    zoomed = page.run(transform)
    assert zoomed != fitted
    viewer.send_keys(Keys.ARROW_RIGHT)
    assert "QIEM" in page.one("#viewer p").text
    assert page.run(transform) == zoomed


def test_a_picture_stands_on_the_page_s_own_ground(page, browser):
    for scheme, dark in (("light", False), ("dark", True)):
        page.open("#surface-0", scheme=scheme)
        page.click("#surface-0 .enlarge")
        page.wait(lambda: page.run("return document.querySelector('#viewer img').complete"))
        seen = Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("L")
        corner = seen.getpixel((5, 5))
        assert (corner < 60) is dark
        box = page.run(
            "const b = document.querySelector('#viewer img').getBoundingClientRect();"
            "return [b.left, b.top]"
        )
        assert abs(seen.getpixel((int(box[0]) + 3, int(box[1]) + 3)) - corner) < 12
        page.run("document.querySelector('#viewer').close()")


def test_a_wide_table_fits_a_desktop_and_keeps_its_first_column_on_a_telephone(page):
    wide = "return [...document.querySelectorAll('table')].sort((a, b) => b.tBodies[0].rows[0]"
    wide += ".cells.length - a.tBodies[0].rows[0].cells.length)[0].closest('.scroll')"
    page.open(size=(1440, 900))
    assert page.run(f"{wide}.scrollWidth <= {wide.removeprefix('return ')}.clientWidth")
    page.open(size=PHONE)
    scroll = page.run(wide)
    page.run("arguments[0].scrollLeft = 200", scroll)
    first, second, own = page.run(
        "const row = arguments[0].querySelector('tbody tr').cells;"
        "return [row[0], row[1], arguments[0]].map(e => e.getBoundingClientRect()"
        ").map(b => [b.left, b.width])",
        scroll,
    )
    assert abs(first[0] - own[0]) < 1  # stays where it is, while the others go
    assert second[0] < first[0] + first[1]
    assert first[1] < 0.4 * own[1]


def test_the_headings_of_the_first_table_wrap_so_that_its_last_column_is_seen(page):
    page.open(size=(1440, 900))
    scroll = "document.querySelector('.findings .scroll')"
    assert page.run(f"return {scroll}.scrollWidth <= {scroll}.clientWidth")
    style = f"getComputedStyle({scroll}.querySelector('.sort'))"
    assert page.run(f"return {style}.whiteSpace") == "normal"


def filtered(page, *choices):
    """Choose in the filter, as a reader does."""
    if not page.one("#filter").is_displayed():
        page.click(".choose")
    for name, value in choices:
        page.click(f"#filter [name='{name}'][value='{value}']")


def test_the_filter_hides_rows_columns_and_pictures_everywhere_and_says_so(page):
    page.open()
    filtered(page, ("surface", "Foot"), ("surface", "Bourbon Bottle"), ("algorithm", "CEM"))
    assert page.column(1) == ["Foot", "", "Bourbon Bottle", ""]
    heads = [h.text for h in visible(page.all("#times thead tr:last-child > *"))]
    assert [words.split()[0] for words in heads] == ["Surface", "Faces", "printedᵖ", "here"]
    groups = [h.text for h in visible(page.all("#times .groups > *"))]
    assert groups == ["", "CEM"]  # with the printed columns
    assert page.column(1, "tfoot") == ["Mean", "n"]
    assert [h.text for h in visible(page.all("#own .groups th"))] == ["angle", "folds"]
    told = page.one("#told").text
    assert "Filter: Bourbon Bottle, Foot · CEM. Hidden on all pages: 6 of 12 rows" in told
    assert "14 of 16 pictures" in told
    assert "2 of 4 rows, 2 columns" in page.one("#times .left-out").text
    assert page.one(".choose").text == "Filter (3)"
    assert [card.text for card in visible(page.all(".cards a"))] == ["Foot", "Bourbon Bottle"]

    page.click(".cards a[href='#surface-0']")
    page.wait(lambda: len(visible(page.all("#surface-0 .side-by-side img"))) == 1)
    assert page.one("#surface-0 .after").text == "Bourbon Bottle"
    assert page.one("#told").is_displayed()
    page.click("#told button")
    page.wait(lambda: len(visible(page.all("#surface-0 .side-by-side img"))) == len(ALGORITHMS))
    assert page.one("#told").text == ""
    page.open("#records")
    filtered(page, ("status", "timeout"))
    assert [r.text for r in visible(page.all(".record h3"))] == ["Bourbon Bottle · fdm"]


def test_a_status_leaves_the_cells_of_that_status(page):
    page.open("#own")
    filtered(page, ("status", "timeout"))
    rows = visible(page.all("#own tbody tr"))
    assert [row.find_element(By.CSS_SELECTOR, "th").text for row in rows] == ["Bourbon Bottle"]
    assert [link.text for link in visible(page.all("#own .figure-link"))] == ["4", "8"]


def test_the_filter_is_used_with_keys_alone(page, browser):
    page.open()
    page.run("document.querySelector('.choose').focus()")
    browser.switch_to.active_element.send_keys(Keys.ENTER)
    assert page.one(".choose").get_attribute("aria-expanded") == "true"
    page.run("document.querySelector('#filter input').focus()")
    browser.switch_to.active_element.send_keys(Keys.SPACE)
    page.wait(lambda: page.one("#told").text)
    assert page.one("#told").get_attribute("role") == "status"
    browser.switch_to.active_element.send_keys(Keys.ESCAPE)
    assert not page.one("#filter").is_displayed()
    assert page.run("return document.activeElement.className").startswith("choose")


def test_a_link_keeps_the_filter_the_order_and_the_open_record(page, browser):
    page.open()
    filtered(page, ("surface", HOSTILE.replace("'", "\\'")), ("surface", "Foot"))
    page.click("#times thead tr:last-child th:nth-child(2) button")
    page.click("#times thead tr:last-child th:nth-child(2) button")
    page.click(".cards a[href='#surface-0']")  # the view goes along
    page.wait(lambda: visible(page.all("#surface-0")))
    page.run("document.querySelector('#surface-0 [href^=\"#record-\"]').click()")
    page.wait(lambda: visible(page.all("#record-shown[open]")))
    browser.set_permissions("clipboard-write", "granted")
    browser.set_permissions("clipboard-read", "granted")
    page.click("#record-shown .copy")
    page.wait(lambda: page.one("#record-shown .copy").text == "Copied")
    link = browser.execute_async_script("navigator.clipboard.readText().then(arguments[0])")
    assert link == browser.current_url

    browser.get("about:blank")
    page.open("#" + link.partition("#")[2])
    page.wait(lambda: "Foot · cem" in page.one("#record-shown").text)
    page.click("#record-shown .close")
    page.wait(lambda: visible(page.all("#surface-0 .back")))
    page.click("#surface-0 .back")
    page.wait(lambda: visible(page.all("#times")))
    assert [words for words in page.column(1) if words] == [HOSTILE, "Foot"]
    head = page.one("#times thead tr:last-child th:nth-child(2)")
    assert head.get_attribute("aria-sort") == "descending"
    page.click("#told button")
    page.click("#times thead tr:last-child th:nth-child(2) button")
    assert "?" not in browser.current_url


def test_the_filter_turns_off_the_lines_of_other_algorithms_in_plots(page):
    page.open("#?algorithm=QIEM")
    page.plot()
    shown = "return document.querySelector('.drawn').data.map((trace) => trace.visible ?? true)"
    page.wait(lambda: page.run(shown) == ["legendonly", True])
    page.click("#told button")
    page.wait(lambda: page.run(shown) == [True, True])


def test_a_picture_shown_again_and_data_come_from_what_the_page_holds(page):
    page.open()
    loaded = "return [...document.querySelectorAll('main img')].every(i => i.src && i.complete)"
    page.wait(lambda: page.run(loaded))
    link = page.one("#times a.data")
    assert link.get_attribute("href").startswith("blob:")
    assert link.get_attribute("download") == "times.csv"


def test_a_browser_that_cannot_unpack_says_so_and_shows_the_rest(page, browser):
    added = page.tell(
        "Page.addScriptToEvaluateOnNewDocument", source="delete window.DecompressionStream"
    )
    try:
        page.open()
        assert "cannot unpack" in page.one("#told p").text
        assert visible(page.all("#times tbody tr"))
        page.click(".cards a")
        page.wait(lambda: visible(page.all("#surface-0 .side-by-side img")))
    finally:
        page.tell("Page.removeScriptToEvaluateOnNewDocument", **added)


def test_claims_are_filtered_by_their_verdict(page):
    page.open()
    page.click(".tally [data-verdict='holds']")
    page.wait(lambda: len(visible(page.all(".claim"))) == 1)
    (shown,) = visible(page.all(".claim"))
    assert shown.get_attribute("data-verdict") == "holds"
    page.click(".tally [data-verdict='holds']")
    page.wait(lambda: len(visible(page.all(".claim"))) == 4)


def test_a_telephone_scrolls_down_only_and_tables_scroll_within(page):
    for anchor in ("", "#surface-3", "#records"):
        assert page.open(anchor, size=PHONE).overflow() == 0
    page.open(size=PHONE)
    page.plot()
    assert page.overflow() == 0
    first = page.one("#wide tbody th")
    left = first.location["x"]
    assert (
        page.run(
            "const box = document.querySelector('#wide .scroll'); box.scrollLeft = 500;"
            "return box.scrollLeft"
        )
        == 500
    )
    assert first.location["x"] == left
    page.click(".menu")
    assert page.one("#toc").is_displayed()


def test_dark_follows_the_system_until_the_reader_chooses_which_is_remembered(page):
    background = "return getComputedStyle(document.documentElement).backgroundColor"
    assert page.open().run(background) == "rgb(255, 255, 255)"
    dark = page.open(scheme="dark").run(background)
    assert dark != "rgb(255, 255, 255)"
    page.click(".theme")
    assert page.run(background) == "rgb(255, 255, 255)"
    assert page.open(scheme="dark").run(background) == "rgb(255, 255, 255)"
    page.run("localStorage.clear()")


def test_a_plot_takes_the_colours_of_the_page(page):
    words = "return getComputedStyle(document.querySelector('.drawn .xtitle')).fill"
    page.open()
    page.plot()
    before = page.run(words)
    page.click(".theme")
    page.wait(lambda: page.run(words) != before)
    page.run("localStorage.clear()")


def test_words_stand_out_from_what_is_behind_them(page):
    for scheme in ("light", "dark"):
        page.open(scheme=scheme)
        page.plot()
        assert not page.run(CONTRASTS)


def test_it_prints_with_every_page_and_picture_and_no_navigation(page):
    page.open(scheme="dark")
    page.tell("Emulation.setEmulatedMedia", media="print")
    try:
        assert len(visible(page.all("section.page"))) == len(SURFACES) + 2
        assert len(visible(page.all(".side-by-side img"))) == len(ALGORITHMS) * (len(SURFACES) + 1)
        assert visible(page.all(".remarks"))
        assert not visible(page.all("nav, .cards, button.theme"))
        printed = page.tell("Page.printToPDF")["data"]
    finally:
        page.tell("Emulation.setEmulatedMedia", media="")
    assert base64.b64decode(printed).startswith(b"%PDF")


def test_without_javascript_everything_stands_one_under_the_other(page):
    page.open(script=False)
    assert len(visible(page.all("section.page"))) == len(SURFACES) + 2
    assert len(visible(page.all(".side-by-side img"))) == len(ALGORITHMS) * (len(SURFACES) + 1)
    assert visible(page.all("#times .remarks"))
    assert "records.csv beside this page" in page.one("#records").text
    assert not visible(page.all("button, form"))


def test_a_surface_named_like_code_stays_a_name(page, browser):
    page.open("#surface-3")
    assert page.one("#surface-3 h2").text == HOSTILE
    page.click("#surface-3 .enlarge")
    assert HOSTILE in page.one("#viewer p").text
    assert browser.get_log("browser") == []

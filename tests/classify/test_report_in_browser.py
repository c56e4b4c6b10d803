"""The report's page in a real browser: Debian's chromium without a window, driven over its own debugging protocol."""

import itertools
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bladewing.classify.report.page import draw_page

websocket = pytest.importorskip("websocket", reason="websocket-client is not installed: pip install '.[dev]'")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium: the report's page is not tried in a browser")

FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions"),
    *("--remote-debugging-port=0", "--remote-allow-origins=*"),
)
PATIENCE_S = 60.0
DESK, PHONE = 1280, 390


class Page:
    """One tab: commands out, answers and events in."""

    def __init__(self, address: str) -> None:
        self.socket = websocket.create_connection(address, timeout=PATIENCE_S)
        self.events: list[dict[str, Any]] = []
        self.numbers = itertools.count(1)

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and wait for its answer; what happens meanwhile is kept in `events`."""
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self.socket.recv())
            if message.get("id") == number:
                assert "error" not in message, message
                result: dict[str, Any] = message["result"]
                return result
            self.events.append(message)

    def value(self, script: str) -> Any:
        """What a piece of JavaScript gives."""
        found = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def show(self, path: Path, width: int, *, scheme: str = "light") -> None:
        """Load a file into a window of this width [CSS pixel]."""
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600)
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.events.clear()
        self.ask("Page.navigate", url=path.as_uri())
        stop = time.monotonic() + PATIENCE_S
        while self.value("document.readyState") != "complete" or self.value("location.href") != path.as_uri():
            assert time.monotonic() < stop, "the page does not load"
            time.sleep(0.02)

    def told(self, *methods: str) -> list[dict[str, Any]]:
        """Events of these kinds since the page was asked for."""
        return [event for event in self.events if event["method"] in methods]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    profile = tmp_path_factory.mktemp("profile")
    process = subprocess.Popen(
        [str(CHROMIUM), *FLAGS, f"--user-data-dir={profile}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        address, stop = profile / "DevToolsActivePort", time.monotonic() + PATIENCE_S
        while not address.exists() or address.read_text().count("\n") < 1:
            assert process.poll() is None, "chromium ended at once"
            assert time.monotonic() < stop, "chromium does not answer"
            time.sleep(0.02)
        port, path = address.read_text().split("\n")[:2]
        browser = Page(f"ws://127.0.0.1:{port}{path}")
        target = browser.ask("Target.createTarget", url="about:blank")["targetId"]
        tab = Page(f"ws://127.0.0.1:{port}/devtools/page/{target}")
        for domain in ("Page", "Runtime", "Log", "Network"):
            tab.ask(f"{domain}.enable")
        yield tab
        tab.socket.close()
        browser.socket.close()
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


@pytest.fixture(scope="module")
def html(report_folder: Path) -> Path:
    return report_folder / "report.html"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [DESK, PHONE])
def test_loads_without_an_error_and_without_a_request_outside(page: Page, html: Path, width: int, scheme: str) -> None:
    page.show(html, width, scheme=scheme)
    asked = [event["params"]["request"]["url"] for event in page.told("Network.requestWillBeSent")]
    assert [url for url in asked if not url.startswith("data:")] == [html.as_uri()]
    complaints = page.told("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")
    assert complaints == []
    ground, ink = page.value("[getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]")
    light = sum(int(part) for part in ground[4:-1].split(",")) > sum(int(part) for part in ink[4:-1].split(","))
    assert light is (scheme == "light")


# Every figure's box, its words' boxes, and what is not a figure but sticks out of the page.
LAYOUT = """(() => {
  document.querySelectorAll("details").forEach((d) => (d.open = true));
  const box = (e) => { const r = e.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };
  const figures = [...document.querySelectorAll("figure")].map((f) => {
    const svg = f.querySelector("svg"), seen = getComputedStyle(f);
    return { name: f.querySelector("figcaption").textContent, box: box(svg), alt: svg.getAttribute("aria-label"),
      role: svg.getAttribute("role"), seen: seen.visibility === "visible" && seen.display !== "none",
      words: [...svg.querySelectorAll("text")].map((t) => ({ text: t.textContent, box: box(t) })) };
  });
  return { figures, wide: document.documentElement.scrollWidth, window: innerWidth };
})()"""


@pytest.mark.parametrize("width", [DESK, PHONE])
def test_every_figure_is_seen_whole_with_readable_words_and_its_text(page: Page, html: Path, width: int) -> None:
    page.show(html, width)
    found = page.value(LAYOUT)
    assert found["window"] == width
    assert found["wide"] <= width, "the page scrolls sideways"
    assert len(found["figures"]) > 15
    for figure in found["figures"]:
        left, top, right, bottom = figure["box"]
        where = f"{figure['name']} at {width}"
        assert figure["seen"], where
        assert right - left > 200, where
        assert bottom - top > 80, where
        assert 0 <= left < right <= width, where
        assert figure["role"] == "img", where
        assert len(figure["alt"]) > 30, where
        words = [word for word in figure["words"] if word["text"].strip()]
        for word in words:
            a, b, c, d = word["box"]
            inside = left - 1 <= a and top - 1 <= b and c <= right + 1 and d <= bottom + 1
            assert inside, f"{where}: {word['text']!r} is cut off"
            assert max(c - a, d - b) >= 8, f"{where}: {word['text']!r} is too small to read"
        for one, other in itertools.combinations(words, 2):
            a, b = one["box"], other["box"]
            across, down = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
            # boxes hold the line's leading: letters touch later than boxes do
            assert across <= 1 or down <= 3, f"{where}: {one['text']!r} lies over {other['text']!r}"


# Of each table: its name, how much wider it is than its view, and how far its caption reaches beyond the view.
TABLES = """[...document.querySelectorAll(".scroll")].map((s) => {
  const caption = s.querySelector("caption"), end = (e) => e.getBoundingClientRect().right;
  return { name: caption ? caption.textContent : s.textContent.trim().slice(0, 30), over: s.scrollWidth - s.clientWidth,
    kind: s.querySelector("table").className, cut: caption ? end(caption) - end(s) : 0 };
})"""


def test_on_a_phone_the_lettered_tables_and_all_captions_are_seen_whole(page: Page, html: Path) -> None:
    page.show(html, PHONE)
    page.value(
        'document.querySelectorAll(".lettered tbody td:last-child").forEach((d) => (d.textContent = "19.46 ms"))'
    )
    tables = page.value(TABLES)
    lettered = [table for table in tables if table["kind"] == "lettered"]
    assert len(lettered) == 2
    assert [table for table in lettered if table["over"] > 0] == []
    assert [table for table in tables if table["cut"] > 1] == []


def test_on_a_small_desk_the_tables_that_are_not_folded_are_seen_whole(page: Page, html: Path) -> None:
    page.show(html, 1200)
    page.value(
        'document.querySelectorAll(".prose td:last-child").forEach((d) => (d.textContent = "no band: ".repeat(30)))'
    )
    tables = page.value(TABLES)
    assert "Measured in them" in [table["name"] for table in tables if table["kind"] == "prose"]
    assert [table for table in tables if table["kind"] in ("stack", "confusion", "prose") and table["over"] > 0] == []


SORTED = """(() => {
  const read = (table, i) => [...table.tBodies[0].rows].map((r) => r.cells[i].dataset.v ?? r.cells[i].textContent);
  return [...document.querySelectorAll("table")].filter((t) => t.querySelector("th button")).map((table) => {
    const button = [...table.querySelectorAll("th button")].at(-1), i = button.closest("th").cellIndex;
    button.click(); const up = read(table, i), sort = button.closest("th").ariaSort;
    button.click(); return [sort, up, read(table, i), button.closest("th").ariaSort];
  });
})()"""


def test_tables_sort_both_ways_by_value(page: Page, html: Path) -> None:
    page.show(html, DESK)
    tables = page.value(SORTED)
    assert len(tables) >= 8

    def key(text: str) -> tuple[int, float, str]:
        try:
            return 0, float(text), ""
        except ValueError:
            return 1, 0.0, text

    for first, rising, falling, second in tables:
        assert (first, second) == ("ascending", "descending")
        rising, falling = ([v for v in column if v not in ("", "–")] for column in (rising, falling))
        assert rising == sorted(rising, key=key)
        assert falling == sorted(falling, key=key, reverse=True)


# Of each square of panels: how many of them stand in each of its rows.
ROWS = """[...document.querySelectorAll(".square")].map((square) => {
  const tops = [...square.children].map((panel) => panel.getBoundingClientRect().top);
  return [...new Set(tops)].map((top) => tops.filter((one) => one === top).length);
})"""


@pytest.fixture(scope="module")
def last_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the last full report, of four models."""
    report = json.loads((Path(__file__).parents[2] / "docs" / "report.json").read_text(encoding="utf-8"))
    assert len(report["models"]) == 4
    drawn = tmp_path_factory.mktemp("last") / "report.html"
    drawn.write_text(draw_page(report), encoding="utf-8")
    return drawn


@pytest.mark.parametrize(
    ("width", "rows"), [(1600, [4]), (1520, [4]), (1519, [2, 2]), (DESK, [2, 2]), (760, [2, 2]), (PHONE, [1, 1, 1, 1])]
)
def test_no_panel_of_four_models_is_left_over(page: Page, last_report: Path, width: int, rows: list[int]) -> None:
    page.show(last_report, width)
    assert page.value(ROWS) == [rows, rows]

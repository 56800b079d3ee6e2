#!/usr/bin/env python3
"""The pages of --preview and view in a real browser: starts renders, opens their pages in headless Chromium and checks what the canvas shows, the exposure, layers,
zoom, pixel values, numbers, several tabs, and what is left when the program has ended.

    tools/preview_test.py [STERADIAN] [--pictures FOLDER]

Needs chromium and chromedriver (Debian: chromium, chromium-driver); without them it prints a message and ends with exit code 77."""

import argparse
import base64
import json
import math
import os
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request

SIZE = (96, 64)
SKY = (0.25, 0.5, 1.5)
SCENE = {
    "film": {"width": SIZE[0], "height": SIZE[1], "filter": {"type": "box"}},
    "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0]},
    "shapes": [{"type": "sphere", "radius": 1}],
    "lights": [{"type": "environment", "radiance": list(SKY)}],
}
SKIP = 77


class Browser:
    """As much of the WebDriver protocol as is needed here."""

    def __init__(self, driver, browser):
        self.driver = subprocess.Popen([driver, "--port=0"], stdout=subprocess.PIPE, text=True)
        line = ""
        while "started successfully on port" not in line:
            line = self.driver.stdout.readline()
            assert line, "chromedriver did not start"
        self.root = f"http://127.0.0.1:{int(line.split()[-1].rstrip('.'))}"
        options = {"binary": browser, "args": ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--window-size=900,600"]}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.session = f"/session/{session['sessionId']}"

    def call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.root + path, data, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=120) as answer:
            return json.load(answer)["value"]

    def command(self, path, body):
        return self.call("POST", self.session + path, body)

    def open(self, url):
        self.command("/url", {"url": url})

    def run(self, script, *arguments):
        """The value of a script in the page."""
        return self.command("/execute/sync", {"script": script, "args": list(arguments)})

    def pointer(self, *actions):
        self.command("/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": list(actions)}]})

    def key(self, key):
        actions = [{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]
        self.command("/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def tabs(self):
        return self.call("GET", self.session + "/window/handles")

    def new_tab(self):
        return self.command("/window/new", {"type": "tab"})["handle"]

    def switch(self, tab):
        self.command("/window", {"handle": tab})

    def complaints(self):
        """What the browser has to complain of since the last call."""
        return [entry["message"] for entry in self.command("/se/log", {"type": "browser"}) if entry["level"] == "SEVERE"]

    def picture(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.call("GET", self.session + "/screenshot")))

    def close(self):
        try:
            self.call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait()


class Render:
    """A render that serves its page."""

    processes = []

    def __init__(self, program, folder, *arguments):
        with open(os.path.join(folder, "ball.json"), "w") as file:
            json.dump(SCENE, file)
        line = [program, "render", "ball.json", "-o", "ball.exr", "--preview", "0", "--layers", "Z,N", *arguments]
        self.process = subprocess.Popen(line, cwd=folder, stderr=subprocess.PIPE, text=True)
        self.processes.append(self.process)
        first = self.process.stderr.readline()
        assert first.startswith("preview: http://127.0.0.1:"), first
        self.url = first.split()[1]

    def get(self, path):
        with urllib.request.urlopen(self.url + path, timeout=60) as answer:
            return json.load(answer)

    def end(self, code):
        self.process.send_signal(signal.SIGINT)
        # Reads on, or the pipe fills up.
        self.process.communicate(timeout=60)
        assert self.process.returncode == code, self.process.returncode


def eventually(what, is_so, seconds=60):
    start = time.monotonic()
    while not (value := is_so()):
        assert time.monotonic() - start < seconds, what
        time.sleep(0.05)
    return value


def half(value):
    try:
        return struct.unpack("<e", struct.pack("<e", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


def encoded(value, stops):
    """A colour's byte on the canvas."""
    value = half(value) * 2**stops
    value = 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055
    return math.floor(min(max(value, 0), 1) * 255 + 0.5)


def agx(light, stops):
    """The byte that AgX makes of a colour's red, green and blue after a number of stops, by the definition in src/output/view.rs."""
    shares = [0.2119946, 0.3921508, 0.3958546]
    light = [half(v) * 2**stops for v in light]

    def curve(v):
        x = min(max((math.log2(max(v, 1e-38) / 0.18) + 10) / 16.5, 0), 1)
        pivot = 10 / 16.5
        reach, power = (pivot, 3) if x < pivot else (1 - pivot, 3.25)
        return 0.5 + 2 * (x - pivot) / (1 + ((4 * reach) ** power - 1) * (abs(x - pivot) / reach) ** power) ** (1 / power)

    mixed = sum(s * v for s, v in zip(shares, light))
    codes = [curve(0.8 * v + 0.2 * mixed) for v in light]
    mixed = sum(s * v for s, v in zip(shares, codes))
    return [math.floor(min(max((v - 0.2 * mixed) / 0.8, 0), 1) * 255 + 0.5) for v in codes]


SHOWN = """
    // The canvas where the middle of this pixel of the picture is.
    const [x, y] = arguments, at = [0, 1].map(k => Math.floor(pan[k] + ([x, y][k] + 0.5) * zoom));
    return [...context.getImageData(at[0], at[1], 1, 1).data];
"""


def shown(browser, x, y):
    return browser.run(SHOWN, x, y)


def same(found, expected, tolerance=0):
    return all(abs(a - b) <= tolerance for a, b in zip(found, expected))


def choose(browser, field, value):
    event = "input" if field == "exposure" else "change"
    browser.run("const e = $(arguments[0]); e.value = arguments[1]; e.dispatchEvent(new Event(arguments[2]));", field, str(value), event)


def number(browser, key):
    return browser.run("return document.querySelector(`[data-key='${arguments[0]}']`)?.textContent", key)


def version(browser):
    return int(browser.run("return document.body.dataset.version || 0"))


def check_colors(browser):
    """Views and exposure: the sky is the same in every picture."""
    choose(browser, "tone", "agx")
    for stops in [0, 2, -3]:
        browser.run("setExposure(arguments[0])", stops)
        assert same(shown(browser, 2, 3), [*agx(SKY, stops), 255], 1), (stops, shown(browser, 2, 3), agx(SKY, stops))
    choose(browser, "tone", "srgb")
    for stops in [0, 1, -2.5, 4]:
        browser.run("setExposure(arguments[0])", stops)
        expected = [encoded(v, stops) for v in SKY]
        found = shown(browser, 2, 3)
        assert same(found, [*expected, 255]), (stops, found, expected)
    choose(browser, "exposure", 0.5)
    assert same(shown(browser, 2, 3), [encoded(v, 0.5) for v in SKY]), "exposure typed in"
    browser.run("setExposure(0)")
    for channel in range(3):
        choose(browser, "channel", channel)
        assert same(shown(browser, 2, 3), [encoded(SKY[channel], 0)] * 3), channel
    choose(browser, "channel", "")


def check_layers(browser):
    names = browser.run("return [...$('layer').options].map(o => o.text)")
    assert names == ["color", "Z", "N"], names
    layer = lambda: browser.run("return document.body.dataset.layer")
    middle = SIZE[0] // 2, SIZE[1] // 2
    choose(browser, "layer", 2)
    eventually("N", lambda: layer() == "N")
    # The normal of the sphere's middle looks at the camera; that of the sky is 0.
    assert same(shown(browser, *middle), [128, 128, 255], 4), shown(browser, *middle)
    assert same(shown(browser, 2, 3), [128, 128, 128]), shown(browser, 2, 3)
    choose(browser, "layer", 1)
    eventually("Z", lambda: layer() == "Z")
    # From the nearest point, black, to the farthest, white; where nothing was hit is beyond.
    assert same(shown(browser, *middle), [0, 0, 0], 4), shown(browser, *middle)
    assert same(shown(browser, 2, 3), [255, 255, 255]), shown(browser, 2, 3)
    choose(browser, "layer", 0)
    eventually("color", lambda: layer() == "color")
    assert same(shown(browser, 2, 3), [encoded(v, 0) for v in SKY])


def on_page(browser, x, y):
    """Where a pixel of the picture is on the page."""
    return browser.run(
        "const box = canvas.getBoundingClientRect();"
        "return [0, 1].map(k => Math.round([box.left, box.top][k] + (pan[k] + (arguments[k] + 0.5) * zoom) / devicePixelRatio));",
        x, y)


def check_zoom(browser):
    fitted = browser.run("return zoom")
    assert fitted > 1 and fitted == int(fitted), fitted
    # Every pixel of the picture is a square of the screen's pixels.
    colors = browser.run("""
        const x = pan[0] + 48 * zoom, y = pan[1] + 32 * zoom, size = zoom;
        const all = [...new Uint32Array(context.getImageData(x, y, size, size).data.buffer)];
        return new Set(all).size;
    """)
    assert colors == 1, colors
    browser.run("$('one').click()")
    assert browser.run("return [zoom, $('zoom').textContent]") == [1, "100 %"]
    browser.run("$('fit').click()")
    before = browser.run("return pan")
    # The wheel keeps what is under the pointer where it is.
    x, y = on_page(browser, 70, 20)
    under = "return [0, 1].map(k => Math.floor(([arguments[0], arguments[1]][k] * devicePixelRatio - pan[k]) / zoom))"
    top = browser.run("const box = canvas.getBoundingClientRect(); return [box.left, box.top]")
    assert browser.run(under, x - top[0], y - top[1]) == [70, 20]
    wheel = {"type": "scroll", "x": x, "y": y, "deltaX": 0, "deltaY": -100, "duration": 0}
    browser.command("/actions", {"actions": [{"type": "wheel", "id": "wheel", "actions": [wheel, wheel]}]})
    assert eventually("wheel", lambda: browser.run("return zoom") > fitted)
    assert browser.run(under, x - top[0], y - top[1]) == [70, 20]
    # Dragging moves the picture with the pointer.
    start = browser.run("return pan")
    move = lambda x, y: {"type": "pointerMove", "x": x, "y": y, "duration": 0}
    browser.pointer(move(x, y), {"type": "pointerDown", "button": 0}, move(x + 30, y + 10), {"type": "pointerUp", "button": 0})
    ratio = browser.run("return devicePixelRatio")
    assert same(browser.run("return pan"), [start[0] + 30 * ratio, start[1] + 10 * ratio], 1e-6)
    assert same(shown(browser, 70, 20), [encoded(v, 0) for v in SKY])
    browser.run("canvas.focus()")
    browser.key("f")
    assert browser.run("return [zoom, ...pan]") == [fitted, *before]
    browser.key("]")
    assert browser.run("return exposure()") == 0.5
    browser.key("[")


def check_pixel(browser, render):
    """The values of a pixel are those of the server, exactly."""
    for x, y in [(2, 3), (48, 32)]:
        px, py = on_page(browser, x, y)
        browser.pointer({"type": "pointerMove", "x": px, "y": py, "duration": 0})

        def told():
            # The picture may change between the two questions.
            found = browser.run("return Object.fromEntries([...document.querySelectorAll('#pixel td')].map(d => [d.dataset.channel, d.textContent]))")
            place = browser.run("return $('place').textContent")
            pixel = render.get(f"pixel?x={x}&y={y}")
            names = [name for layer in pixel["layers"] for name in layer["channels"]]
            values = [value for layer in pixel["layers"] for value in layer["values"]]
            if place != f"Pixel {x}, {y}" or set(found) != set(names):
                return None
            return all(float(found[name]) == float(value) for name, value in zip(names, values)) and found

        found = eventually("the values of a pixel", told)
        assert set(found) == {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"}, found
        if (x, y) == (2, 3):
            assert [float(found[c]) for c in "RGB"] == list(SKY) and float(found["Z"]) == 1e10, found


def check_progress(browser):
    first, samples = version(browser), lambda: float(number(browser, "Samples").split()[0])
    before = samples()
    eventually("newer pictures", lambda: version(browser) >= first + 3 and samples() > before)
    spp = float(number(browser, "Samples per pixel").split()[0])
    assert spp > 0 and float(number(browser, "Samples/s").split()[0]) > 0
    assert number(browser, "Elapsed") and number(browser, "Left") not in ("?", "none"), number(browser, "Left")
    assert number(browser, "Size") == f"{SIZE[0]} × {SIZE[1]}"
    assert browser.run("return $('status').textContent") == "rendering"


def check_view(browser, program, folder, pictures):
    """The page of two finished files: sides of the slider, values of both, the map of differences."""
    for name, spp in [("a", "1"), ("b", "16")]:
        line = [program, "render", "ball.json", "-o", f"{name}.exr", "--layers", "Z", "--spp", spp, "--integrator", "path" if spp == "1" else "normal", "-q"]
        subprocess.run(line, cwd=folder, check=True)
    process = subprocess.Popen([program, "view", "a.exr", "b.exr", "--no-open"], cwd=folder, stdout=subprocess.PIPE, text=True)
    Render.processes.append(process)
    url = process.stdout.readline().strip()
    browser.open(url)
    mode = lambda: browser.run("return document.body.dataset.mode")
    eventually("both pictures", lambda: mode() == "slider" and browser.run("return other !== null"))
    # The sky is of light in one picture and black in the other.
    browser.run("$('split').value = 50; draw()")
    light, dark = [*agx(SKY, 0), 255], [*agx([0, 0, 0], 0), 255]
    assert same(shown(browser, 2, 3), light, 1) and same(shown(browser, 90, 3), dark, 1), (shown(browser, 2, 3), shown(browser, 90, 3))
    # Dragging the slider to the left uncovers the second picture.
    start, end = on_page(browser, 48, 10), on_page(browser, 1, 10)
    move = lambda x, y: {"type": "pointerMove", "x": x, "y": y, "duration": 0}
    browser.pointer(move(*start), {"type": "pointerDown", "button": 0}, move(*end), {"type": "pointerUp", "button": 0})
    assert same(shown(browser, 4, 3), dark, 1), shown(browser, 4, 3)
    browser.pointer(move(*on_page(browser, 2, 3)))
    values = lambda: browser.run("return [...document.querySelectorAll(\"#pixel td[data-channel='R']\")].map(d => Number(d.textContent))")
    eventually("values of both", lambda: values() == [SKY[0], 0])
    if pictures:
        browser.run("$('split').value = 50; draw()")
        browser.picture(os.path.join(pictures, "view.png"))
    for name, expected in [("first", light), ("second", dark)]:
        choose(browser, "mode", name)
        eventually(name, lambda: mode() == name and same(shown(browser, 2, 3), expected, 1))
    choose(browser, "mode", "flip")
    eventually("FLIP", lambda: mode() == "flip" and 0 < float(number(browser, "Mean FLIP") or 0) <= 1)
    choose(browser, "layer", 1)
    eventually("Z", lambda: browser.run("return document.body.dataset.layer") == "Z")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 0, process.returncode


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="?", default="target/release/steradian")
    parser.add_argument("--pictures", help="screenshots go to this folder")
    arguments = parser.parse_args()
    driver, chromium = shutil.which("chromedriver"), shutil.which("chromium")
    if not (driver and chromium):
        print("skipped: chromium and chromedriver are needed")
        return SKIP
    program = os.path.abspath(arguments.program)
    if arguments.pictures:
        os.makedirs(arguments.pictures, exist_ok=True)
    browser = Browser(driver, chromium)
    status = lambda: browser.run("return $('status').textContent")
    try:
        with tempfile.TemporaryDirectory() as folder:
            render = Render(program, folder, "--spp", "2000000000", "--time-limit", "300", "--threads", "1")
            browser.open(render.url)
            eventually("a picture", lambda: version(browser) > 0)
            for check in [check_colors, check_layers, check_zoom, check_progress]:
                check(browser)
                print(f"{check.__name__}: passed")
            check_pixel(browser, render)
            print("check_pixel: passed")
            first = browser.tabs()[0]
            second = browser.new_tab()
            browser.switch(second)
            browser.open(render.url)
            eventually("a picture in the second tab", lambda: version(browser) > 0)
            check_progress(browser)
            browser.switch(first)
            check_progress(browser)
            print("two tabs: passed")
            if arguments.pictures:
                browser.picture(os.path.join(arguments.pictures, "preview_running.png"))
            assert not browser.complaints(), "the browser complained"
            render.end(130)
            eventually("the end", lambda: status() == "finished; the program has ended")
            # What is there can still be looked at.
            check_layers(browser)
            check_colors(browser)
            x, y = on_page(browser, 2, 3)
            browser.pointer({"type": "pointerMove", "x": x, "y": y, "duration": 0})
            eventually("values without the server", lambda: browser.run("return document.querySelector('#pixel td').textContent") == f"≈ {SKY[0]}")
            if arguments.pictures:
                browser.picture(os.path.join(arguments.pictures, "preview_ended.png"))
            print("after the end: passed")

            render = Render(program, folder, "--spp", "100000", "--target-error", "1e-9", "--preview-hold", "--time-limit", "5")
            browser.open(render.url)
            eventually("the finished picture", lambda: status() == "finished" and version(browser) > 0)
            assert float(number(browser, "Error")) >= 0 and float(number(browser, "Target")) == 1e-9
            check_pixel(browser, render)
            render.process.kill()
            render.process.communicate()
            eventually("the end", lambda: status() == "finished; the program has ended")
            print("with a target error, held: passed")

            render = Render(program, folder, "--spp", "2000000000", "--time-limit", "300")
            browser.open(render.url)
            eventually("a picture", lambda: version(browser) > 0)
            render.process.kill()
            render.process.communicate()
            eventually("the end", lambda: status() == "connection lost")
            check_colors(browser)
            print("killed in the middle: passed")
            check_view(browser, program, folder, arguments.pictures)
            print("check_view: passed")
    finally:
        browser.close()
        for process in Render.processes:
            process.kill()
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Opens the page of a run in a headless browser: frames advance, Stop ends the run.

Usage: browser.py GRASP FOLDER [PAGE]. Pictures go to FOLDER. Needs chromium and chromedriver.
PAGE is the page that needs no program.
"""
import atexit, base64, json, os, re, subprocess, sys, time, urllib.error, urllib.request

grasp, folder = sys.argv[1:3]
page = sys.argv[3] if len(sys.argv) > 3 else None


def child(*words, **more):
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, **more)
    atexit.register(process.kill)
    return process


class Browser:
    def __init__(self, width, height):
        self.driver = child("chromedriver", "--port=0")
        for line in self.driver.stdout:
            if found := re.search(r"successfully on port (\d+)", line):
                break
        self.base = f"http://127.0.0.1:{found[1]}"
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
                 "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", "--hide-scrollbars",
                 f"--window-size={width},{height}", f"--user-data-dir={folder}/profile-{width}"]
        options = {"goog:chromeOptions": {"args": flags}}
        made = self.ask("POST", "/session", {"capabilities": {"alwaysMatch": options}})
        self.base += f"/session/{made['sessionId']}"

    def ask(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.base + path, data, method=method)
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            sys.exit(f"{path}: {error.read().decode()}")

    def run(self, script, *arguments):
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def open(self, url):
        self.ask("POST", "/url", {"url": url})

    def element(self, selector):
        found = self.ask("POST", "/element", {"using": "css selector", "value": selector})
        return next(iter(found.values()))

    def picture(self, name):
        with open(os.path.join(folder, name), "wb") as file:
            file.write(base64.b64decode(self.ask("GET", "/screenshot")))

    def close(self):
        self.ask("DELETE", "")
        self.driver.terminate()


def wait(what, check, seconds=60):
    end = time.time() + seconds
    while time.time() < end:
        if found := check():
            return found
        time.sleep(0.1)
    sys.exit(f"{what}: not within {seconds} s")


def post(url, headers):
    request = urllib.request.Request(url, b"", headers, method="POST")
    try:
        return urllib.request.urlopen(request, timeout=10).status
    except urllib.error.HTTPError as error:
        return error.code


def start(address):
    program = child(grasp, "--live", address, "--realtime", "--save-runs", "--runs", "50",
                    "--frames-of", "0", "--out", f"{folder}/run", stderr=subprocess.STDOUT)
    for line in program.stdout:
        if found := re.search(r"watch it at (http\S+)", line):
            return program, found[1]
    sys.exit("the program did not say where its page is")


program, url = start("127.0.0.1:0")
# A viewer who never reads must not hold up anything.
lazy = urllib.request.urlopen(url + "events", timeout=60)
desktop, phone = Browser(1280, 1200), Browser(412, 915)
for browser in (desktop, phone):
    browser.open(url)
frame = "return +(document.body.dataset.frame || 0)"
first = wait("a first frame", lambda: desktop.run(frame), 240)
wait("later frames", lambda: desktop.run(frame) > first + 8, 120)
wait("frames on the other page", lambda: phone.run(frame), 60)
wide = "return document.documentElement.scrollWidth <= innerWidth"
assert phone.run(wide), "the page is wider than a phone"
assert desktop.run("return document.querySelector('#phases .now') !== null"), "no state is shown"
wait("a ball in view", lambda: desktop.run("return live.track.length > 4"), 120)
desktop.picture("desktop.png")
phone.picture("phone.png")

# A page that lost its connection goes on where it was.
before = desktop.run("return live.log.length")
desktop.open(url)
wait("the run after a reload", lambda: desktop.run("return live.log.length") >= before, 60)

assert post(url + "stop", {}) == 403, "another origin could stop the arm"
desktop.ask("POST", f"/element/{desktop.element('#stop')}/click", {})
said = program.communicate(timeout=60)[0]
assert program.returncode == 130, (program.returncode, said)
assert "stopped" in said, said
wait("the end on the page", lambda: "broken off" in desktop.run(
    "return document.getElementById('now').textContent"), 30)

# The finished run plays from its file.
saved = f"{folder}/run/saved/run001.json"
field = desktop.element("#file")
desktop.ask("POST", f"/element/{field}/value", {"text": os.path.abspath(saved)})
wait("the saved run", lambda: desktop.run("return file && +document.getElementById('slider').max"))
desktop.run("const s = document.getElementById('slider'); s.value = s.max; s.oninput();")
wait("its last state", lambda: desktop.run(
    "return document.querySelector('#phase-End.now') !== null"), 10)
desktop.picture("saved.png")

# Beyond this machine a token is needed.
program, url = start("0.0.0.0:0")
base, token = url.replace("0.0.0.0", "127.0.0.1").split("?token=")
assert post(base + "stop", {"x-stop": "1"}) == 403
assert post(base + "stop?token=" + token[:-1] + "x", {"x-stop": "1"}) == 403
assert post(f"{base}stop?token={token}", {"x-stop": "1"}) == 200
program.communicate(timeout=120)
assert program.returncode == 130

# The page that learns and reaches by itself, from the disk.
if page:
    desktop.open("file://" + os.path.abspath(page))
    ended = "return document.body.dataset.ended"
    for button in "teach", "go":
        wait(button, lambda: desktop.run(f"return !document.getElementById('{button}').disabled"))
        desktop.ask("POST", f"/element/{desktop.element('#' + button)}/click", {})
        time.sleep(0.5)
    wait("a ball in view", lambda: desktop.run("return live.track.length > 3"), 120)
    desktop.picture("tab.png")
    said = wait("the end of the reach", lambda: desktop.run(ended), 120)
    assert said == "grasped", said

for browser in (desktop, phone):
    browser.close()
print("the page: frames advance, Stop ends the run, a saved run plays")

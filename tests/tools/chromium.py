"""A headless Chromium, driven through its DevTools protocol over a pipe."""

import json
import os
import shutil
import subprocess
import time

PROGRAMS = ("chromium-headless-shell", "chromium")
TIMEOUT_S = 60  # a guard against hanging


def find_chromium():
    """Path of the program, or None."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


class Page:
    """One page; what it logs as error or warning, what it throws and what it loads is kept."""

    def __init__(self, program, folder):
        command_read, self._to_browser = os.pipe()
        self._from_browser, answer_write = os.pipe()
        self._buffer, self._next_id = b"", 0
        self.errors, self.loaded, self.posted = [], [], []
        # The browser reads descriptor 3 and writes 4. No sandbox: it needs what containers lack, and shows our page alone.
        self._process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{command_read} 4>&{answer_write}', "bash", program, "--headless",
             "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-extensions",
             "--disable-background-networking", "--disable-component-update", "--force-color-profile=srgb",
             "--remote-debugging-pipe", f"--user-data-dir={folder}", "about:blank"],
            pass_fds=(command_read, answer_write), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(command_read)
        os.close(answer_write)
        self._session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page", "Network"):
            self.call(f"{domain}.enable")

    def close(self):
        self._process.terminate()
        self._process.wait(TIMEOUT_S)
        os.close(self._to_browser)
        os.close(self._from_browser)

    def call(self, method, **params):
        self._next_id += 1
        message = {"id": self._next_id, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to_browser, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self._next_id:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]

    def _receive(self):
        while b"\0" not in self._buffer:
            data = os.read(self._from_browser, 1 << 20)
            assert data, "the browser ended"
            self._buffer += data
        text, self._buffer = self._buffer.split(b"\0", 1)
        message = json.loads(text)
        self._keep(message.get("method"), message.get("params", {}))
        return message

    def _keep(self, event, params):
        if event == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(params["exceptionDetails"]))
        elif event == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(json.dumps(params["args"]))
        elif event == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.errors.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")
        elif event == "Network.requestWillBeSent":
            self.loaded.append(params["request"]["url"])
            self.posted.append((params["request"]["url"], params["request"].get("postData", "")))

    def open(self, url):
        self.call("Page.navigate", url="about:blank")  # else only what stands behind '#' would change
        self.call("Page.navigate", url=url)
        self.wait("location.href !== 'about:blank' && document.readyState === 'complete'")

    def run(self, script):
        """The value of an expression; promises are waited for."""
        result = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, f"{script}: {result['exceptionDetails']}"
        return result["result"].get("value")

    def wait(self, script):
        """The value of an expression once it is true."""
        until = time.monotonic() + TIMEOUT_S
        while True:
            value = self.run(script)
            if value:
                return value
            text = "document.body.innerText.slice(0, 3000)"
            assert time.monotonic() < until, f"never true: {script}\n{self.run(text)}\n{self.errors}"
            time.sleep(0.02)

    def press(self, key, code=0, text=None):
        typed = {"text": text} if text else {}
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code,
                      **(typed if kind == "keyDown" else {}))

    def type_into(self, selector, text):
        """As from a keyboard, over what stands there."""
        self.run(f"document.querySelector('{selector}').focus(); document.querySelector('{selector}').select()")
        self.call("Input.insertText", text=text)

    def choose_file(self, selector, path):
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=selector)["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(path)])

    def view(self, width, height, scheme="light"):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

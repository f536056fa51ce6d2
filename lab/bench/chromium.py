# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, spoken to over its DevTools pipe: no driver, no port, no sleeping."""

from __future__ import annotations

import base64
from collections.abc import Callable
import json
import os
from pathlib import Path
import shutil
import subprocess
from types import TracebackType
from typing import Any

EXECUTABLE = next((path for name in ('chromium', 'chromium-browser', 'google-chrome', 'chrome')
                   if (path := shutil.which(name))), None)


class Page:
    """One page of a browser of its own; everything it asks for or complains about is kept."""

    def __init__(self, profile: Path, width: int = 1100, height: int = 900) -> None:
        """Start the browser."""
        assert EXECUTABLE is not None
        to_browser, ours = os.pipe()
        theirs, from_browser = os.pipe()[::-1]
        self.requests: list[str] = []
        self.complaints: list[str] = []

        def plumb() -> None:  # the browser reads 3 and writes 4
            os.dup2(to_browser, 10)
            os.dup2(theirs, 11)
            os.dup2(10, 3)
            os.dup2(11, 4)

        self._process = subprocess.Popen(
            [EXECUTABLE, '--headless', '--no-sandbox', '--disable-gpu', '--hide-scrollbars',
             '--no-first-run', '--disable-background-networking', '--disable-component-update',
             '--remote-debugging-pipe', f'--user-data-dir={profile}',
             f'--window-size={width},{height}', 'about:blank'],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=plumb,
            close_fds=False)
        os.close(to_browser)
        os.close(theirs)
        self._out = os.fdopen(ours, 'wb', buffering=0)
        self._in = os.fdopen(from_browser, 'rb')
        self._number = 0
        self._session: str | None = None
        target = next(t for t in self._ask('Target.getTargets')['targetInfos']
                      if t['type'] == 'page')
        self._session = self._ask('Target.attachToTarget', targetId=target['targetId'],
                                  flatten=True)['sessionId']
        for domain in ('Page', 'Network', 'Runtime', 'Log'):
            self._ask(f'{domain}.enable')

    def __enter__(self) -> Page:
        """Return the page."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """End the browser."""
        self._out.close()
        self._in.close()
        self._process.kill()
        self._process.wait()

    def _read(self) -> dict[str, Any]:
        content = bytearray()
        while (byte := self._in.read(1)) != b'\0':
            if not byte:
                raise RuntimeError('the browser has ended')
            content += byte
        message: dict[str, Any] = json.loads(content)
        parameters = message.get('params', {})
        if message.get('method') == 'Network.requestWillBeSent':
            self.requests.append(parameters['request']['url'])
        elif message.get('method') == 'Runtime.exceptionThrown':
            self.complaints.append(str(parameters['exceptionDetails']))
        elif message.get('method') == 'Log.entryAdded':
            self.complaints.append(parameters['entry']['text'])
        return message

    def _ask(self, method: str, **parameters: Any) -> Any:
        self._number += 1
        question = {'id': self._number, 'method': method, 'params': parameters}
        if self._session:
            question['sessionId'] = self._session
        self._out.write(json.dumps(question).encode() + b'\0')
        return self._until(lambda message: message.get('id') == self._number)['result']

    def _until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        while not wanted(message := self._read()):
            pass
        return message

    def open(self, url: str) -> None:  # noqa: A003 (as browsers say)
        """Load a page and wait until it is loaded."""
        self._ask('Page.navigate', url=url)
        self._until(lambda message: message.get('method') == 'Page.loadEventFired')

    def tell(self, expression: str) -> Any:
        """Return the value of a JavaScript expression."""
        return self._ask('Runtime.evaluate', expression=expression,
                         returnByValue=True)['result'].get('value')

    def until(self, expression: str, patience_s: float = 90.0) -> Any:
        """Wait until a JavaScript expression is true; return its value, or fail."""
        answer = self._ask('Runtime.evaluate', awaitPromise=True, returnByValue=True, expression=(
            'new Promise((done, fail) => { let told = ""; const look = () => { let value;'
            f' try {{ value = ({expression}); }} catch (error) {{ told = String(error); }}'
            ' value ? done(value) : setTimeout(look, 20); }; look();'
            f' setTimeout(() => fail(new Error(told)), {1e3 * patience_s}); }})'))
        assert 'exceptionDetails' not in answer, f'in vain: {expression}: {answer}'
        return answer['result'].get('value')

    def look(self, width: int, height: int, dark: bool = False) -> None:
        """Give the window a size, and the page the colours of day or night."""
        self._ask('Emulation.setDeviceMetricsOverride', width=width, height=height,
                  deviceScaleFactor=1, mobile=width < 500)
        self._ask('Emulation.setEmulatedMedia', features=[
            {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}])

    def picture(self, path: Path) -> None:
        """Write what the window shows as PNG."""
        answer = self._ask('Page.captureScreenshot', format='png')
        path.write_bytes(base64.b64decode(answer['data']))

    def heap_MB(self) -> float:
        """Return the memory of the page's own objects, after a collection."""
        self._ask('HeapProfiler.collectGarbage')
        used: float = self._ask('Runtime.getHeapUsage')['usedSize']
        return used / 2**20

    def click(self, selector: str) -> None:
        """Press and release the mouse in the middle of an element."""
        x, y = self.place(selector)
        for kind in ('mousePressed', 'mouseReleased'):
            self.mouse(kind, x, y, button='left', clickCount=1)

    def place(self, selector: str, across: float = 0.5) -> tuple[float, float]:
        """Bring an element into view; return a place in it, from its left 0 to its right 1."""
        found = self.until(
            f'(() => {{ const e = document.querySelector({json.dumps(selector)});'
            ' e.scrollIntoView({block: "center", behavior: "instant"});'
            f' const b = e.getBoundingClientRect(); return b.width && [b.left + {across}'
            ' * b.width, b.top + b.height / 2]; })()')
        return found[0], found[1]

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """Move, press, release or turn the wheel of the mouse, as a person does."""
        self._ask('Input.dispatchMouseEvent', type=kind, x=x, y=y, **more)

    def fingers(self) -> None:
        """Make the window one that is touched."""
        self._ask('Emulation.setTouchEmulationEnabled', enabled=True)

    def tap(self, selector: str, across: float = 0.5) -> None:
        """Touch an element with a finger, at a place from its left 0 to its right 1."""
        x, y = self.place(selector, across)
        for kind, points in (('touchStart', [{'x': x, 'y': y}]), ('touchEnd', [])):
            self._ask('Input.dispatchTouchEvent', type=kind, touchPoints=points)

    def key(self, key: str, **more: Any) -> None:
        """Press a key; `more` may have modifiers, 8 for Shift."""
        text = {'text': key} if len(key) == 1 else {}
        self._ask('Input.dispatchKeyEvent', type='keyDown', key=key, **text, **more)
        self._ask('Input.dispatchKeyEvent', type='keyUp', key=key, **more)

"""The live page over its own protocol, without a browser: a client connects, is told the scene, and the server ends."""

from __future__ import annotations

import socket
import threading
import time
import urllib.request
from typing import Any

import msgspec
import pytest
import viser
import zstandard
from websockets.sync.client import connect

from cdfctl.errors import InputError, MissingError
from cdfctl.report.view import server as served
from cdfctl.report.view.clock import Clock
from cdfctl.report.view.panel import LOOKS
from cdfctl.report.view.replay import Replay
from cdfctl.report.view.server import serving
from cdfctl.report.view.viewer import Viewer

from .made import by_hand, first_steps

BROWSER = {"subprotocols": [f"viser-v{viser.__version__}"], "max_size": None, "compression": None}


def messages(data: bytes) -> list[dict[str, Any]]:
    """Those of one frame: two lengths, then MessagePack under zstandard."""
    length, packed = (int.from_bytes(data[i : i + 8], "little") for i in (0, 8))
    text = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], max_output_size=length)
    return list(msgspec.msgpack.decode(text)["messages"])


def heard(port: int, wanted: set[str], seconds: float = 30.0) -> list[dict[str, Any]]:
    """What a client is told until every type in ``wanted`` has come."""
    found: list[dict[str, Any]] = []
    with connect(f"ws://127.0.0.1:{port}", **BROWSER) as client:
        end = time.monotonic() + seconds
        while not wanted <= {message["type"] for message in found} and time.monotonic() < end:
            found += messages(client.recv(timeout=seconds))
    return found


def test_a_client_is_told_the_scene_the_controls_and_the_charts(replay, capfd):
    with serving(port=0) as server:
        viewer = Viewer(server, replay, "a *title*", ["a fact"])
        stop = threading.Event()
        thread = threading.Thread(target=viewer.run, args=(stop.is_set,))
        thread.start()
        port = server.get_port()
        page = urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=30).read()
        assert page.lower().startswith(b"<!doctype html>")
        told = heard(port, {"GlbMessage", "GuiSliderMessage", "GuiHtmlMessage", "ReplayDoneMessage"})
        stop.set()
        thread.join(30)
    names = [message["name"] for message in told if message["type"] == "GlbMessage"]
    assert len(names) == 11
    assert all(name.startswith("/robot/") for name in names)
    (slider,) = (message["props"] for message in told if message["type"] == "GuiSliderMessage")
    assert (slider["min"], slider["max"]) == (0.0, pytest.approx(2.0))
    assert any("h: signed distance" in str(message) for message in told)
    assert any(LOOKS[1] in str(message) for message in told if message["type"] == "GuiDropdownMessage")
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", port), timeout=5)
    assert capfd.readouterr().out == ""


class Growing:
    """A source with one more look at a longer run, after which it is over."""

    def __init__(self, *rest: Replay) -> None:
        self.rest, self.complete = list(rest), False

    def poll(self) -> Replay | None:
        self.complete = len(self.rest) <= 1
        return self.rest.pop(0) if self.rest else None


def test_a_run_in_progress_is_followed_to_its_end(replay, monkeypatch):
    from cdfctl.report.view import viewer as module

    monkeypatch.setattr(module, "POLL", 0.0)
    monkeypatch.setattr(module, "PERIOD", 0.0)
    whole = by_hand(replay.body.scenario, 20)
    parts = [Replay(replay.body, first_steps(whole, steps)) for steps in (3, 9, 20)]
    with serving(port=0) as server:
        viewer = Viewer(server, parts[0], "t", [], Growing(*parts[1:]))
        assert viewer.clock == Clock(t=pytest.approx(0.3), following=True)
        viewer.clock.speed = 1e9
        looks = iter([False, False, False, True])
        viewer.run(lambda: next(looks))
    assert viewer.replay.steps == 20
    assert not viewer.clock.following
    assert len(viewer._clearance) == 21


def test_a_port_that_is_taken_is_one_line():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"cannot serve on 127.0.0.1:{port}") as caught, serving(port=port):
            pass
    assert "--port" in str(caught.value)


def test_an_address_that_is_not_here_is_one_line():
    with pytest.raises(InputError, match=r"cannot serve on 192\.0\.2\.1"), serving("192.0.2.1", 0):
        pass


def test_only_this_machine_is_served_unless_asked(monkeypatch):
    given: dict[str, Any] = {}

    class Server:
        def __init__(self, **options: Any) -> None:
            given.update(options)

        def stop(self) -> None: ...

    monkeypatch.setattr(viser, "ViserServer", Server)
    with serving():
        assert (given["host"], given["port"]) == ("127.0.0.1", served.PORT)


def test_without_viser_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "viser", None)
    with pytest.raises(MissingError, match="viser") as caught, serving():
        pass
    assert "python -m pip install 'cdfctl[view]'" in str(caught.value)

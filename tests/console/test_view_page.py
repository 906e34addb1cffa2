"""The page of `exograv view` loads nothing from elsewhere, keeps data out of its scripts, and answers us only."""

import base64
import http.client
import json
import re
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from exograv.console.page_files import PAGES, page_files
from exograv.console.view_page import MODULES, ViewData, served_page, single_page
from exograv.console.view_server import page_server
from exograv.errors import ConfigError
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.scene import describe_scene

THREE = PAGES / "vendor" / "three"
SIZE_MAX_BYTES = 1_200_000
EVIL = "</script><script>alert(1)</script>"


@pytest.fixture(scope="module")
def data() -> ViewData:
    return ViewData(EVIL, "right arm", describe_scene(load_rig("recupera_like"), Body(1.75, 75.0, "male")))


@pytest.fixture(scope="module")
def port(data: ViewData) -> Iterator[int]:
    with page_server(served_page(data), 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_address[1]
        server.shutdown()
        thread.join()


def answer(port: int, path: str, host: str | None = None, method: str = "GET") -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host or f"127.0.0.1:{port}")
    connection.endheaders()
    response = connection.getresponse()
    return response.status, dict(response.getheaders()), response.read()


def content(page: str) -> dict:
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page)
    return json.loads(found)


@pytest.mark.parametrize("made", [served_page, single_page])
def test_a_text_in_the_data_cannot_end_its_element(made, data: ViewData):
    assert content(made(data))["title"] == EVIL
    assert "alert(1)</script>" not in made(data)


def test_the_single_file_asks_nobody_for_anything(data: ViewData):
    page = single_page(data)
    assert "/files/" not in page
    (imports,) = re.findall(r'<script type="importmap">(.*?)</script>', page)
    modules = json.loads(imports)["imports"]
    assert list(modules) == [f"exograv/{name}" for name in MODULES]
    for name, address in modules.items():
        text = base64.b64decode(address.removeprefix("data:text/javascript;base64,")).decode()
        assert set(re.findall(r'(?:from|import) ?"([^"]+)"', text)) <= set(modules), name
        assert not re.search(r"https?://(?!www\.w3\.org/1999/xhtml)", text)


def test_the_served_page_has_no_script_of_its_own_and_the_policy_of_the_console(port: int):
    status, headers, body = answer(port, "/")
    assert status == 200
    assert headers["Content-Security-Policy"].startswith("default-src 'self'")
    assert "Server" not in headers or headers["Server"].strip() == ""
    scripts = re.findall(r"<script[^>]*>", body.decode())
    assert sorted(scripts) == [
        '<script type="application/json" id="data">',
        '<script type="module" src="/files/view.js">',
    ]
    assert answer(port, "/files/vendor/three/three.min.js")[2] == page_files()["vendor/three/three.min.js"]


@pytest.mark.parametrize(
    "path", ["/files/../server.py", "/etc/passwd", "/files/", "/%2e%2e/", "/files/vendor/three/LICENSE"]
)
def test_a_path_that_is_no_page_file_is_not_found(path: str, port: int):
    assert answer(port, path)[0] == 404


def test_a_foreign_host_name_gets_nothing(port: int):
    status, _, body = answer(port, "/", host=f"rebound.example:{port}")
    assert (status, body) == (403, b"")
    assert answer(port, "/", host=f"localhost:{port}")[0] == 200


def test_a_page_cannot_be_changed(port: int):
    assert answer(port, "/", method="POST")[0] == 501


def test_a_port_in_use_is_refused_with_advice(port: int, data: ViewData):
    with pytest.raises(ConfigError, match=rf"Port {port} .* --port"), page_server("", port):
        pass
    with pytest.raises(ConfigError, match="--port is 70000; allowed: 1 to 65535"), page_server("", 70000):
        pass


def test_three_js_is_small_and_its_licence_and_version_are_told_where_people_look():
    script = (THREE / "three.min.js").read_text(encoding="utf-8")
    version = re.search(r"three@(\d+\.(\d+)\.\d+)", (THREE / "README.md").read_text(encoding="utf-8"))
    assert version is not None
    assert f'"{version[2]}"' in script[:500]
    assert len(script) < SIZE_MAX_BYTES
    assert "MIT License" in (THREE / "LICENSE").read_text(encoding="utf-8")
    assert f"three.js {version[1]}" in Path("docs/explanation/stack.md").read_text(encoding="utf-8")

"""Pages work in a network: over TLS, under one name, on a tablet in either orientation, and after a lost connection."""

import datetime
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from ipaddress import IPv4Address
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from playwright.sync_api import Browser
from tests.console.serving import Served, served
from tests.waiting import wait_until

from exograv.console import lease
from exograv.console.keys import Role
from exograv.console.options import Address

from .of_browser import RETURN_S, Visitor, quick_plan, take_arm
from .test_lost import totals

LAN = "127.0.0.2"
"""Address of this computer that differs from the one that it serves without a certificate."""

HOURS = datetime.timedelta(hours=2)


def certificate_in(folder: Path) -> tuple[Path, Path]:
    """Make a self-signed certificate and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name, now = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, LAN)]), datetime.datetime.now(datetime.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - HOURS)
        .not_valid_after(now + HOURS)
        .add_extension(x509.SubjectAlternativeName([x509.IPAddress(IPv4Address(LAN))]), critical=False)
        .sign(key, hashes.SHA256())
    )
    pem, plain = serialization.Encoding.PEM, serialization.NoEncryption()
    certificate, key_path = folder / "certificate.pem", folder / "key.pem"
    certificate.write_bytes(made.public_bytes(pem))
    key_path.write_bytes(key.private_bytes(pem, serialization.PrivateFormat.PKCS8, plain))
    return certificate, key_path


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    monkeypatch.setattr(lease, "LEASE_S", 8.0)
    certificate, key = certificate_in(tmp_path)
    address = Address(port=0, lan=LAN, certificate=certificate, key=key)
    with served(tmp_path, quick_plan(), address=address) as running:
        yield running


def answered(house: Served, host: str, origin: str | None, certificate: Path) -> int:
    """Answer of the server to a client that trusts its certificate and uses this host name."""
    trust = ssl.create_default_context(cafile=certificate)
    headers = {"Host": host, "X-Exograv": "1"} | ({} if origin is None else {"Origin": origin})
    asked = urllib.request.Request(f"{house.hub.origin}/enter", b'{"token": ""}', headers)
    try:
        with urllib.request.urlopen(asked, context=trust) as response:
            return response.status
    except urllib.error.HTTPError as error:
        with error:
            return 0 if b"link is wrong" in error.read() else error.code


def test_two_computers_share_a_session_over_tls_and_a_tablet_is_held_either_way(
    house: Served, browser: Browser, tmp_path: Path
):
    # The token is wrong each time; 0 means that the server has checked it.
    ours, certificate = house.hub.origin.removeprefix("https://"), tmp_path / "certificate.pem"
    assert answered(house, ours, house.hub.origin, certificate) == 0
    assert answered(house, "rebound.example", house.hub.origin, certificate) == 403
    assert answered(house, ours, "https://evil.example", certificate) == 403
    assert answered(house, ours.replace(LAN, "localhost"), house.hub.origin, certificate) == 403
    operator, tablet = Visitor(browser, house, Role.OPERATOR), Visitor(browser, house, Role.PARTICIPANT)
    try:
        assert tablet.page.url.startswith(f"https://{LAN}:")
        assert tablet.page.evaluate("[isSecureContext, crossOriginIsolated]") == [True, True]
        cookies = tablet.context.cookies()
        assert {cookie.get("path") for cookie in cookies} == {"/participant/", "/files/"}
        kinds = {(cookie.get("secure"), cookie.get("httpOnly"), cookie.get("sameSite")) for cookie in cookies}
        assert kinds == {(True, True, "Strict")}
        take_arm(operator)
        operator.press("[data-run=start]")
        tablet.sees("body[data-screen=task]")
        for number, (width, height) in enumerate(((1280, 800), (800, 1280))):
            tablet.page.set_viewport_size({"width": width, "height": height})
            time.sleep(RETURN_S)
            tablet.page.touchscreen.tap(width / 2 + 3.0, height / 2 + 4.0)
            wait_until(lambda count=number + 1: totals(house).accepted == count)
            if number == 0:
                house.cut_off(Role.PARTICIPANT)
                tablet.sees("body[data-line=away]")
                tablet.sees("body[data-line=open]")
        touches = [said for topic, _, said in house.desk.written if topic == "/task" and said["kind"] == "touch"]
        assert {round(touch["deviation_px"], 3) for touch in touches} == {5.0}
        house.cut_off(Role.OPERATOR)
        operator.sees("body[data-line=away]")
        operator.sees("body[data-steers=true]")
    finally:
        for visitor in (operator, tablet):
            visitor.close()

"""Options of the console's server."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError


@dataclass(frozen=True)
class Address:
    """Place at which the pages are served; it is checked when the server begins."""

    port: int = 8088
    """TCP port on this computer; 0 takes a free one."""

    browser: bool = True
    """Open the link in this computer's browser."""

    lan: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Serve tablets too: the address or name by which they reach this computer. Needs a certificate."""

    certificate: Path | None = None
    """Of TLS, as PEM, with `--lan`."""

    key: Path | None = None
    """Its private key."""

    @property
    def scheme(self) -> str:
        """Of the pages."""
        return "http" if self.lan is None else "https"

    def check(self) -> None:
        """Before anything else.

        Raises:
            ConfigError: It cannot be served like that.
        """
        import ssl

        if not 0 <= self.port <= 65535:
            raise ConfigError(f"--port is {self.port}; allowed: 1 to 65535, or 0 for a free one.")
        if self.lan is None:
            if self.certificate is not None or self.key is not None:
                raise ConfigError("--certificate and --key are for --lan; this computer alone needs none.")
            return
        if self.certificate is None or self.key is None:
            raise ConfigError(
                f"--lan {self.lan} is given without --certificate and --key. In a network pages are only served with "
                "TLS: give both files (docs/console.md says how to make them)."
            )
        if self.lan in ("0.0.0.0", "::", ""):
            raise ConfigError(
                f"--lan is '{self.lan}'; give the one address or name by which tablets reach this computer. Pages "
                "that ask by another name are refused."
            )
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key)
        except (OSError, ssl.SSLError) as error:
            raise ConfigError(
                f"{self.certificate} and {self.key} are no certificate and its key: {error}. Give two PEM files."
            ) from error

"""Options of the console's server."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from exograv.errors import ConfigError


@dataclass(frozen=True)
class Address:
    """Address at which the pages are served. It is checked when the server starts."""

    port: int = 8088
    """TCP port on this computer; 0 for a free port."""

    browser: bool = True
    """Open the link in this computer's browser."""

    lan: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Serve tablets too, at this address or name of the computer. This needs a certificate."""

    certificate: Path | None = None
    """Certificate for TLS as a PEM file, with `--lan`."""

    key: Path | None = None
    """Private key of the certificate as a PEM file."""

    @property
    def scheme(self) -> str:
        """URL scheme of the pages."""
        return "http" if self.lan is None else "https"

    def check(self) -> None:
        """Check the address before the server starts.

        Raises:
            ConfigError: Pages cannot be served at this address.
        """
        import ssl

        if not 0 <= self.port <= 65535:
            raise ConfigError(f"--port is {self.port}; allowed: 1 to 65535, or 0 for a free one.")
        if self.lan is None:
            if self.certificate is not None or self.key is not None:
                raise ConfigError("--certificate and --key need --lan. Leave them out to serve this computer only.")
            return
        if self.certificate is None or self.key is None:
            raise ConfigError(
                f"--lan {self.lan} is given without --certificate and --key. Pages are served in a network with TLS "
                "only: give both files (docs/howto/console.md says how to make them)."
            )
        if self.lan in ("0.0.0.0", "::", ""):
            raise ConfigError(
                f"--lan is '{self.lan}'; give the one address or name by which tablets reach this computer. Requests "
                "by another name are refused."
            )
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key)
        except (OSError, ssl.SSLError) as error:
            raise ConfigError(
                f"{self.certificate} and {self.key} are not a certificate and its key: {error}. Give two PEM files."
            ) from error

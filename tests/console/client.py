"""Starlette's test client."""

import warnings

with warnings.catch_warnings():
    # It would rather have httpx2, the successor of the httpx that our lock pins.
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient as TestClient

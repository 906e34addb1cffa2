"""Session that a person steers from a page: requests, decisions and snapshots."""

"""A secret opens one thing, once or for a day, and wrong secrets of others lock nobody out."""

import pytest

from exograv.console.keys import (
    FAILURE_S,
    FAILURES_MAX,
    KEPT_MAX,
    LINK_S,
    SESSION_S,
    TICKET_S,
    TICKETS_MAX,
    AccessKeys,
    PageSession,
    Role,
    TokenUse,
)

from .of_clock import SetClock

HOME = "127.0.0.1"
KEY = bytes(32)


def entered(keys: AccessKeys, role: Role = Role.OPERATOR) -> tuple[str, PageSession]:
    """Cookie and session after a login."""
    outcome = keys.enter(keys.token(role), HOME)
    assert not isinstance(outcome, TokenUse)
    assert outcome[0] is role
    session = keys.session(role, outcome[1])
    assert session is not None
    return outcome[1], session


def test_a_token_has_256_bits_and_no_two_are_alike():
    keys = AccessKeys(SetClock())
    tokens = {keys.token(Role.OPERATOR) for _ in range(50)}
    assert len(tokens) == 50
    assert all(len(token) >= 43 for token in tokens)


@pytest.mark.parametrize("role", Role)
def test_a_token_lets_one_in_once_and_in_its_role_only(role: Role):
    keys = AccessKeys(SetClock())
    token = keys.token(role)
    first = keys.enter(token, HOME)
    assert not isinstance(first, TokenUse)
    assert keys.enter(token, HOME) is TokenUse.REFUSED
    for other in Role:
        assert (keys.session(other, first[1]) is not None) == (other is role)


def test_a_link_ends_after_a_quarter_of_an_hour_and_a_cookie_after_a_day():
    clock = SetClock()
    keys = AccessKeys(clock)
    token = keys.token(Role.VIEWER)
    clock.t += LINK_S + 1.0
    assert keys.enter(token, HOME) is TokenUse.REFUSED
    cookie, _ = entered(keys)
    clock.t += SESSION_S - 1.0
    assert keys.session(Role.OPERATOR, cookie) is not None
    clock.t += 2.0
    assert keys.session(Role.OPERATOR, cookie) is None


def test_a_ticket_opens_one_line_of_its_own_session_and_soon():
    clock = SetClock()
    keys = AccessKeys(clock)
    (_, session), (_, other) = entered(keys), entered(keys)
    ticket = keys.ticket(session)
    assert keys.redeem(session, ticket)
    assert not keys.redeem(session, ticket)
    assert not keys.redeem(other, keys.ticket(session))
    late = keys.ticket(session)
    clock.t += TICKET_S + 0.1
    assert not keys.redeem(session, late)


def test_a_token_is_no_cookie_and_a_cookie_no_ticket():
    keys = AccessKeys(SetClock())
    cookie, session = entered(keys)
    assert keys.session(Role.OPERATOR, keys.token(Role.OPERATOR)) is None
    assert not keys.redeem(session, cookie)
    assert keys.enter(cookie, HOME) is TokenUse.REFUSED


def test_a_right_token_opens_after_any_number_of_wrong_ones_from_its_address():
    clock = SetClock()
    keys = AccessKeys(clock)
    for _ in range(FAILURES_MAX):
        assert keys.enter("wrong", HOME) is TokenUse.REFUSED
    assert keys.enter("wrong", HOME) is TokenUse.LOCKED
    assert not isinstance(keys.enter(keys.token(Role.OPERATOR), HOME), TokenUse)
    assert keys.enter("wrong", "192.168.1.7") is TokenUse.REFUSED
    clock.t += FAILURE_S + 0.1
    assert keys.enter("wrong", HOME) is TokenUse.REFUSED


def test_tickets_of_one_login_replace_no_ticket_of_another():
    keys = AccessKeys(SetClock())
    (_, operator), (_, viewer) = entered(keys), entered(keys, Role.VIEWER)
    ticket, first = keys.ticket(operator), keys.ticket(viewer)
    for _ in range(64):
        keys.ticket(viewer)
    assert keys.redeem(operator, ticket)
    assert not keys.redeem(viewer, first)
    assert len(keys._tickets._held) == TICKETS_MAX


def test_a_server_with_the_same_key_knows_the_cookies_of_the_one_before():
    clock = SetClock()
    before, after, other = AccessKeys(clock, KEY), AccessKeys(clock, KEY, 1000), AccessKeys(clock)
    cookie, session = entered(before)
    assert after.session(Role.OPERATOR, cookie) == session
    assert other.session(Role.OPERATOR, cookie) is None
    assert entered(after)[1] != session


@pytest.mark.parametrize("change", ["signature", "number", "letter", "empty", "dot"])
def test_a_changed_cookie_opens_nothing(change: str):
    keys = AccessKeys(SetClock(), KEY)
    cookie, _ = entered(keys)
    changed = {"signature": cookie[:-1] + "!", "number": "1" + cookie, "letter": cookie + "é", "empty": "", "dot": "."}
    assert keys.session(Role.OPERATOR, changed[change]) is None


def test_nobody_fills_the_memory_with_secrets_or_addresses():
    keys = AccessKeys(SetClock())
    first = keys.token(Role.VIEWER)
    for number in range(2 * KEPT_MAX):
        keys.token(Role.VIEWER)
        keys.enter("wrong", f"10.0.0.{number}")
    assert keys.enter(first, HOME) is TokenUse.REFUSED
    assert len(keys._failures) <= KEPT_MAX + 1
    assert len(keys._tokens._held) <= KEPT_MAX


def test_the_server_keeps_no_secret_as_it_is(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("secrets.token_urlsafe", lambda _: "a-known-secret")
    keys = AccessKeys(SetClock())
    assert keys.token(Role.VIEWER) == "a-known-secret"
    assert "a-known-secret" not in repr(vars(keys._tokens))

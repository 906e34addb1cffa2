"""Filling an outbox never waits, words arrive in order, and the oldest news are dropped."""

import asyncio

from exograv.console.outbox import NEWS_MAX, WORDS_MAX, Outbox


async def all_of(box: Outbox) -> list[str]:
    """Messages that the outbox gives without waiting."""
    out = list[str]()
    while True:
        try:
            out.append(await asyncio.wait_for(box.next(), 0.01))
        except TimeoutError:
            return out


def test_words_come_before_news_in_their_order_and_of_news_the_latest():
    async def fill_and_empty() -> None:
        box = Outbox()
        for number in range(10):
            box.show("trace", f"n{number}")
            box.say(f"w{number}")
        out = await all_of(box)
        assert out == [*(f"w{number}" for number in range(10)), *(f"n{number}" for number in range(10 - NEWS_MAX, 10))]
        assert box.dropped == 10 - NEWS_MAX

    asyncio.run(fill_and_empty())


def test_a_page_that_does_not_read_is_given_up_before_it_fills_the_memory():
    box = Outbox()
    for number in range(10 * WORDS_MAX):
        box.say(str(number))
        box.show("trace", str(number))
    assert box.is_full
    assert len(box._words) == WORDS_MAX
    assert len(box._news["trace"]) == NEWS_MAX


def test_whoever_waits_for_the_next_gets_it_when_it_comes():
    async def wait() -> None:
        box = Outbox()
        waiting = asyncio.create_task(box.next())
        await asyncio.sleep(0)
        box.say("now")
        assert await waiting == "now"

    asyncio.run(wait())

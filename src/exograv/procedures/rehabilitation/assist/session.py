"""Blocks of a session: attempts with constant support, then one decision. The guard ramps the support."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from exograv.procedures.rehabilitation.assist.participant_record import AssistBlock, AssistSession
from exograv.procedures.rehabilitation.support_level.flight import Attempt
from exograv.procedures.rehabilitation.support_level.targets import TARGETS
from exograv.task.assist_as_needed import AssistSettings, AssistState, decide


@runtime_checkable
class Attempts(Protocol):
    """Source of a person's attempts, such as a `SupportFlight`."""

    def attempt(self, target: int, support: float) -> Attempt:
        """Simulate one attempt at this target; the machine carries this share of the arm's weight."""
        ...


def fly_session(
    flight: Attempts, session: AssistSession, told: Callable[[AssistSession, AssistBlock], None]
) -> AssistSession:
    """Run all remaining blocks. `told` receives each block after its decision.

    Raises:
        RigError: The envelope stopped the run.
    """
    rule = session.protocol.rule
    while len(session.blocks) < session.protocol.blocks:
        block = fly_block(flight, rule, session.state)
        blocks = (*session.blocks, block)
        is_over = len(blocks) == session.protocol.blocks
        session = session.model_copy(update={"blocks": blocks, "is_over": is_over})
        told(session, block)
    return session


def fly_block(flight: Attempts, rule: AssistSettings, state: AssistState) -> AssistBlock:
    """Run one block: one target after another. An arm that sinks ends the block."""
    reached, sank = list[bool](), False
    while len(reached) < rule.block and not sank:
        one = flight.attempt(len(reached) % len(TARGETS), state.support_percent / 100.0)
        reached.append(one.reached)
        sank = one.rescued
    decision = decide(rule, state, reached, sank)
    after = decision.state
    return AssistBlock(
        support_percent=state.support_percent,
        reached=tuple(reached),
        sank=sank,
        code=decision.code,
        gaps=dict(decision.gaps),
        after_percent=after.support_percent,
        has_failed=after.has_failed,
    )

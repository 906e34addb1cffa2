"""Every option is declared once, on the class that uses it."""

from collections import Counter
from dataclasses import dataclass, fields

import pytest

from exograv.cli import ACTIONS
from exograv.cli.shell.base_options import Common
from exograv.cli.shell.command import option_classes
from exograv.errors import ConfigError
from exograv.options import Level, Options, Within


@dataclass(frozen=True)
class Some(Options):
    """Options of the test."""

    level: Level = 2


@pytest.mark.parametrize("word", sorted(ACTIONS))
def test_no_option_of_a_command_is_declared_twice(word: str):
    kinds = [kind for kind in option_classes(ACTIONS[word]).values() if not issubclass(kind, Common)]
    count = Counter(field.name for kind in kinds for field in fields(kind))
    assert [name for name, times in count.items() if times > 1] == []


@pytest.mark.parametrize("word", sorted(ACTIONS))
def test_no_command_copies_what_every_command_takes(word: str):
    kinds = [kind for kind in option_classes(ACTIONS[word]).values() if not issubclass(kind, Common)]
    assert not {field.name for kind in kinds for field in fields(kind)} & {"json"}


def test_a_range_is_checked_where_the_option_is_declared():
    assert Some(4).level == 4
    with pytest.raises(ConfigError, match=r"--level is 5; allowed: 0 \(none\) to 4"):
        Some(5)
    with pytest.raises(ConfigError, match="--share is nan; allowed: 0 to 1"):
        Within(0, 1).refuse("--share", float("nan"))

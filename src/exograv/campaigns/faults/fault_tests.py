"""Faults without a scenario: the tests that prove the reaction to each, or the reason for a missing test.

Together with the scenario table and the strikes at real processes they cover F01 to F51.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class TestedFault:
    """A fault and the tests that prove the reaction to it."""

    id: str
    what: str

    proved_by: tuple[str, ...]
    """Tests that prove the reaction, by their names in pytest."""

    cells: tuple[str, ...] = ()
    """Cells of `exograv dev process-faults` that fly the fault at real processes, for its option `--only`."""


TESTED_FAULTS = (
    TestedFault(
        "F18",
        "the recorder dies, or its disk is slow (also tested by strikes)",
        (
            "tests/runtime/recorder/test_recorder.py::test_no_acknowledged_tick_is_missing_or_repeated_after_kills_at_random_moments",
            "tests/runtime/recorder/test_recorder.py::test_a_slow_disk_delays_no_process_and_loses_no_tick",
        ),
    ),
    TestedFault(
        "F19",
        "the disk is full or fails (also tested by strikes)",
        (
            "tests/runtime/recorder/test_recorder.py::test_a_full_disk_is_reported_within_a_second_and_does_not_delay_control",
            "tests/recording/test_durability.py::test_a_sync_that_fails_ends_the_recording_and_is_never_repeated",
        ),
    ),
    TestedFault(
        "F20",
        "power is lost while recording",
        (
            "tests/recording/test_durability.py::test_every_crash_image_holds_a_prefix_of_the_messages_and_says_that_it_was_cut",
            "tests/recording/test_durability.py::test_the_zeros_that_a_power_failure_leaves_at_the_end_are_no_ticks",
        ),
    ),
    TestedFault(
        "F21",
        "the wall clock jumps",
        (
            "tests/campaigns/faults/test_proved_elsewhere.py::test_nothing_that_moves_a_machine_asks_for_the_time_of_day",
        ),
    ),
    TestedFault(
        "F22",
        "a URDF is corrupt or hostile",
        (
            "tests/model/test_urdf.py::test_a_file_that_could_hurt_later_is_refused_with_its_place",
            "tests/model/test_urdf.py::test_changed_bytes_give_a_physical_tree_or_a_model_error",
            "tests/model/test_urdf.py::test_any_attribute_with_any_number_gives_a_physical_tree_or_a_model_error",
        ),
    ),
    TestedFault(
        "F23",
        "a settings file is corrupt, or in wrong units",
        (
            "tests/model/test_description.py::test_a_mistake_in_the_rig_file_is_refused_with_its_place",
            "tests/storage/test_calibration_file.py::test_a_damaged_file_is_refused_with_the_next_step",
            "tests/model/test_anthropometry.py::test_a_person_in_wrong_units_is_refused",
        ),
    ),
    TestedFault(
        "F24",
        "a recording, a person's or a machine's file is altered",
        (
            "tests/recording/test_durability.py::test_no_altered_byte_changes_a_message_without_notice",
            "tests/storage/test_calibration_file.py::test_every_changed_digit_is_found",
            "tests/storage/test_participant_file.py::test_a_changed_value_is_refused",
        ),
    ),
    TestedFault(
        "F27",
        "the identifier pauses, hangs or dies: it is a separate process, and control drops its outdated results",
        (
            "tests/runtime/control_loop/test_worker.py::test_a_replacement_worker_begins_with_the_first_sample",
            "tests/live/test_live_identification.py::test_a_finding_is_taken_once_and_one_of_an_earlier_time_never",
            "tests/scenario/test_learn_live.py::test_a_worker_that_is_killed_is_replaced_and_the_arm_learned_all_the_same",
        ),
    ),
    TestedFault(
        "F31",
        "the operator's page is lost, or frozen",
        (
            "tests/runtime/control_loop/test_steering.py::test_a_lease_is_never_longer_than_allowed",
            "tests/runtime/control_loop/test_steering.py::test_an_arm_without_a_lease_is_given_back_once",
            "tests/runtime/control_loop/test_steering.py::test_a_window_is_finished_without_an_operator_and_never_longer_than_a_window_takes",
            "tests/runtime/control_loop/test_guard_commands.py::test_an_arm_that_is_carried_when_the_lease_ends_is_given_back",
            "tests/runtime/control_loop/test_guard_commands.py::test_without_its_parent_the_guard_lets_the_arm_down_and_ends_the_run",
            "tests/experiment/steered/test_session_controller.py::test_where_nobody_steers_any_more_there_is_an_alarm_and_the_arm_is_given_back",
            "tests/scenario/test_console_struck.py::test_a_console_that_is_killed_lets_the_arm_down_within_the_lease",
            "tests/scenario/test_console_struck.py::test_pages_that_stand_still_have_the_arm_given_back_when_the_lease_ends_and_come_back",
        ),
    ),
    TestedFault(
        "F32",
        "two operators: one lease, the second watches",
        (
            "tests/console/test_lease.py::test_in_no_history_do_two_write",
            "tests/console/test_permissions.py::test_what_steers_is_taken_from_the_page_that_holds_the_lease_only",
            "tests/browser/test_roles.py::test_the_second_operator_watches_until_the_first_is_gone",
        ),
    ),
    TestedFault(
        "F33",
        "a command comes twice, late, or was made for something that has changed",
        (
            "tests/experiment/steered/test_session_controller.py::test_the_same_act_twice_is_done_once_and_answered_twice",
            "tests/experiment/steered/test_session_controller.py::test_in_no_history_is_an_arm_carried_that_nobody_made_ready_and_took",
            "tests/experiment/steered/test_request_validation.py::test_what_comes_late_or_from_the_future_is_refused_and_stop_is_not",
            "tests/experiment/steered/test_request_validation.py::test_what_was_asked_for_something_that_has_changed_since_is_refused",
        ),
    ),
    TestedFault(
        "F34",
        "a message is malformed, huge, deep or binary (100 000 messages: `python benchmarks/console_fuzz.py`)",
        (
            "tests/console/test_messages.py::test_anything_is_read_without_an_exception",
            "tests/console/test_line.py::test_a_line_that_is_misused_is_closed_with_its_code_and_counted",
            "tests/console/test_serve.py::test_a_frame_beyond_16_kib_is_not_even_read_to_its_end",
        ),
    ),
    TestedFault(
        "F35",
        "a client is unauthorised, of another origin, or uses a rebound host name",
        (
            "tests/console/test_server.py::test_under_another_name_nothing_is_there",
            "tests/console/test_server.py::test_no_line_is_opened_from_another_origin",
            "tests/console/test_line.py::test_a_line_whose_first_words_hold_no_ticket_is_closed_with_4401",
        ),
    ),
    TestedFault(
        "F36",
        "a role asks for an act that it has no permission for",
        (
            "tests/console/test_permissions.py::test_what_a_role_may_not_say_reaches_nobody_and_is_an_alarm",
            "tests/browser/test_roles.py::test_a_participant_page_that_sends_start_is_refused_and_the_operator_is_told",
        ),
    ),
    TestedFault(
        "F40",
        "two faults at a time (`pairs` of a campaign)",
        (
            "tests/campaigns/faults/test_faults.py::test_in_sixty_scenarios_nothing_leaves_the_envelope_and_every_miss_has_a_known_cause",
        ),
    ),
    TestedFault(
        "F42",
        "a process spins in an endless loop, or its memory is exhausted",
        (
            "tests/live/test_native_flight.py::test_a_control_in_an_endless_loop_delays_no_tick_and_is_ended",
            "tests/campaigns/process_faults/test_real_cells.py::test_a_killed_process_of_a_real_session_is_as_expected",
        ),
        (
            "control:spin:floating",
            "guard:spin:floating",
            "worker:spin:moving",
            "recorder:spin:floating",
            "parent:spin:floating",
            "control:memory:floating",
        ),
    ),
    TestedFault(
        "F43",
        "the terminal is closed, a signal ends or stops the session, or the computer is suspended",
        (
            "tests/runtime/processes/test_spawn.py::test_a_process_has_a_session_of_its_own_so_that_no_key_of_a_terminal_stops_it",
            "tests/runtime/processes/test_spawn.py::test_a_closed_terminal_that_kills_a_process_leaves_no_shared_memory",
        ),
        (
            "session:hup:floating",
            "parent:term:floating",
            "session:quit:floating",
            "session:ctrl-z:floating",
            "session:suspend:floating",
        ),
    ),
    TestedFault(
        "F44",
        "a message between processes is half a word, wrong, or not read, or a process raises an exception",
        (
            "tests/live/test_native_flight.py::test_half_a_word_of_the_parent_lowers_the_arm_at_once_and_costs_no_tick",
            "tests/runtime/control_loop/test_guard_commands.py::test_a_word_or_half_a_word_by_the_pipe_means_the_end",
        ),
        (
            "parent:half-word:floating",
            "parent:full-pipe:floating",
            "control:exception:floating",
            "guard:exception:floating",
        ),
    ),
)

UNTESTED_FAULTS: Mapping[str, str] = MappingProxyType(
    {
        "F37": "memory leaks: `exograv run live --seconds 3600` reports the growth (docs/explanation/realtime.md); no "
        "test runs so long"
    }
)
"""Reason for a missing test, by identifier of the fault."""
